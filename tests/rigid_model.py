"""A machine as rigid bodies, each with all six freedoms, tied by Lagrange multipliers: the witness of `trivet.dynamics`.

Nothing here knows chains, screws or recursions.  Bodies lie between the joints, locked ones included; what a joint forbids is
written as distances and right angles that stay what they are, of points and directions fixed in either of its two bodies, and
differentiated twice by hand.  Velocities u are those of the centres of mass and the angular ones, body by body, the platform
last, in axes of {O}.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from trivet.kinematics.jacobian import actuator_names
from trivet.kinematics.standing import stand
from trivet.model import Machine
from trivet.model.elements import Curvilinear, Drivable, Element, Joint, Prismatic, Revolute, Spherical, Universal
from trivet.model.mass import RigidMass, platform_mass
from trivet.space.frame import Frame

Array = np.ndarray[Any, Any]
Parts = list[tuple[RigidMass, Frame]]
"""What weighs, each in a frame of its own."""
GROUND, PLATFORM = -1, -2


class Body(NamedTuple):
    """A rigid body: mass, centre of mass, and moments of inertia about that, in {O}."""

    mass: float
    centre: Array
    inertia: Array


class Move(NamedTuple):
    """Velocities u, from which the bodies' own are taken."""

    bodies: list[Body]
    u: Array

    def spin(self, body: int) -> Array:
        return np.zeros(3) if body == GROUND else self.u[6 * body + 3 : 6 * body + 6]

    def velocity(self, body: int, at: Array) -> Array:
        if body == GROUND:
            return np.zeros(3)
        return self.u[6 * body : 6 * body + 3] + np.cross(self.spin(body), at - self.bodies[body].centre)

    def turning(self, body: int, direction: Array) -> Array:
        """How fast a direction fixed in a body changes."""
        return np.cross(self.spin(body), direction)

    def centripetal(self, body: int, arm: Array) -> Array:
        return np.cross(self.spin(body), np.cross(self.spin(body), arm))

    def bend(self, body: int, at: Array) -> Array:
        """Acceleration of a point of a body whose own accelerations are zero."""
        return np.zeros(3) if body == GROUND else self.centripetal(body, at - self.bodies[body].centre)


class Gap(NamedTuple):
    """Distance between a point of either body, along a direction n fixed in the first: n . (p2 - p1)."""

    first: int
    second: int
    along: Array
    start: Array
    end: Array

    def row(self, bodies: list[Body]) -> Array:
        """d/dt = n . (v2 - v1) + (w1 x n) . (p2 - p1)."""
        row = np.zeros(6 * len(bodies))
        for body, at, sign in ((self.first, self.start, -1.0), (self.second, self.end, 1.0)):
            if body != GROUND:
                row[6 * body : 6 * body + 6] += sign * np.r_[self.along, np.cross(at - bodies[body].centre, self.along)]
        if self.first != GROUND:
            row[6 * self.first + 3 : 6 * self.first + 6] += np.cross(self.along, self.end - self.start)
        return row

    def bend(self, move: Move) -> float:
        """What the second derivative is without accelerations."""
        n, apart = self.along, self.end - self.start
        speed = move.velocity(self.second, self.end) - move.velocity(self.first, self.start)
        rise = move.bend(self.second, self.end) - move.bend(self.first, self.start)
        return float(n @ rise + 2 * move.turning(self.first, n) @ speed + move.centripetal(self.first, n) @ apart)


class Square(NamedTuple):
    """A direction a of the first body and a direction b of the second: a . b."""

    first: int
    second: int
    a: Array
    b: Array

    def row(self, bodies: list[Body]) -> Array:
        """d/dt = (w1 x a) . b + a . (w2 x b) = (w1 - w2) . (a x b)."""
        return _spins(bodies, self.first, self.second, -np.cross(self.a, self.b))

    def bend(self, move: Move) -> float:
        a, b = self.a, self.b
        turned = move.turning(self.first, a) @ move.turning(self.second, b)
        return float(move.centripetal(self.first, a) @ b + 2 * turned + a @ move.centripetal(self.second, b))


class Rate(NamedTuple):
    """Angular velocity of the second body against the first along a direction n fixed in one of them: n . (w2 - w1)."""

    first: int
    second: int
    along: Array
    carrier: int

    def row(self, bodies: list[Body]) -> Array:
        return _spins(bodies, self.first, self.second, self.along)

    def bend(self, move: Move) -> float:
        return float(move.turning(self.carrier, self.along) @ (move.spin(self.second) - move.spin(self.first)))


Law = Gap | Square | Rate


class Tie(NamedTuple):
    """A joint between two bodies, the first nearer to the ground."""

    name: str
    element: Element
    second: int
    place: Array
    """Where its wrench is told (3,), and along which axes, columns (3, 3)."""
    axes: Array
    laws: list[Law]
    """What it keeps at zero speed."""
    coordinates: list[Law]
    """What changes with unit speed per unit speed of its coordinates."""


class Found(NamedTuple):
    """Accelerations and forces that fulfil the equations of motion."""

    acceleration: Array
    """Of the platform centre and of the platform's turning (6,)."""
    forces: Array
    """Of the drives in the order of Q (6,)."""
    wrenches: Array
    """Per joint, on the body beyond it, at the joint in its axes (joints, 6)."""
    drives: Array
    """Second derivatives of the drives' coordinates (6,)."""


class RigidModel:
    """A machine at one pose, all its bodies and joints."""

    def __init__(self, machine: Machine, pose: Frame, signs: Any, creep: float = 0.0) -> None:
        self.creep = creep
        self.origin = np.array(pose.origin, dtype=float)
        own: Parts = [(platform_mass(machine.platform, machine.stock), pose)]
        parts, ties = [], []
        for leg, _, steps in stand(machine, pose, signs):
            body, carried = GROUND, []  # what stands on the ground weighs nothing
            frames = [frame for _, frame, _ in steps] + [pose.place(leg.platform_frame())]
            for (element, frame, coordinate), beyond in zip(steps, frames[1:], strict=True):
                if isinstance(element, Joint):
                    carried, first, body = [], body, len(parts)
                    if element is steps[-1][0]:
                        carried, body = own, PLATFORM
                    else:
                        parts.append(carried)
                    told = (
                        beyond
                        if isinstance(element, Curvilinear) or (first == GROUND and isinstance(element, Prismatic))
                        else frame
                    )
                    ties.append((f"{leg.name}.{element.name}", element, frame, beyond, coordinate, told, first, body))
                carried.append((element.weigh(machine.stock), beyond))
        self.bodies = [_body(part) for part in (*parts, own)]
        self.ties = [_tie(*tie, len(parts) if body == PLATFORM else body) for *tie, body in ties]
        names = [tie.name for tie in self.ties]
        self.driven = [names.index(name) for name in actuator_names(machine)]
        self.size = 6 * len(self.bodies)
        self.laws = [law for tie in self.ties for law in tie.laws]
        self.rows = np.array([law.row(self.bodies) for law in self.laws])
        self.drives = np.array([self.ties[k].coordinates[0].row(self.bodies) for k in self.driven])
        self.mass = np.zeros((self.size, self.size))
        for k, body_of in enumerate(self.bodies):
            self.mass[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = body_of.mass * np.eye(3)
            self.mass[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = body_of.inertia
        self.motors = self.mass * 0
        for tie in self.ties:
            for law in tie.coordinates:
                row = law.row(self.bodies)
                self.motors += _reflected(tie.element) * np.outer(row, row)

    def velocities(self, twist: Array) -> Array:
        """u at a twist of the platform centre."""
        carried = twist[:3] + np.cross(twist[3:], self.bodies[-1].centre - self.origin)
        return self._with_platform(np.r_[carried, twist[3:]], np.zeros(len(self.rows)))

    def accelerations(self, u: Array, acceleration: Array) -> Array:
        """The time derivative of u at an acceleration of the platform."""
        arm, spin = self.bodies[-1].centre - self.origin, u[-3:]
        carried = acceleration[:3] + np.cross(acceleration[3:], arm) + np.cross(spin, np.cross(spin, arm))
        return self._with_platform(np.r_[carried, acceleration[3:]], self._bends(u))

    def motions(self) -> Array:
        """u per unit twists of the platform centre (size, 6)."""
        return np.stack([self.velocities(unit) for unit in np.eye(6)], axis=-1)

    def inverse(self, twist: Array, acceleration: Array, load: Array, gravity: Array) -> Found:
        """What the drives must give for a motion."""
        u = self.velocities(twist)
        rise = self.accelerations(u, acceleration)
        needed = self.needs(u, rise, gravity) - self._of_load(load)
        solved = np.linalg.solve(np.concatenate([self.rows, self.drives]).T, needed)
        return self._found(u, rise, solved[: len(self.rows)], solved[len(self.rows) :])

    def forward(self, twist: Array, forces: Array, load: Array, gravity: Array) -> Found:
        """How the machine moves under forces of its drives."""
        u = self.velocities(twist)
        count = len(self.rows)
        matrix = np.block([[self.mass + self.motors, -self.rows.T], [self.rows, np.zeros((count, count))]])
        right = self.drives.T @ forces + self._of_load(load) - self.needs(u, np.zeros(self.size), gravity)
        right = np.r_[right, -self._bends(u)]
        solved = np.linalg.solve(matrix, right)
        for _ in range(2):  # masses are small beside the rows: rounding shows
            solved += np.linalg.solve(matrix, right - matrix @ solved)
        return self._found(u, solved[: self.size], solved[self.size :], forces)

    def needs(self, u: Array, rise: Array, gravity: Array) -> Array:
        """Wrenches (size,) that the bodies need for a motion against inertia, weight, motors and friction."""
        needed = self.inertial(u, rise) + self.weight(gravity)
        for tie in self.ties:
            needed += self._against(tie, u, rise)
        return needed

    def inertial(self, u: Array, rise: Array) -> Array:
        """Newton and Euler, body by body."""
        needed = self.mass @ rise
        for k, body in enumerate(self.bodies):
            spin = u[6 * k + 3 : 6 * k + 6]
            needed[6 * k + 3 : 6 * k + 6] += np.cross(spin, body.inertia @ spin)
        return needed

    def weight(self, gravity: Array) -> Array:
        return np.concatenate([np.r_[-body.mass * gravity, np.zeros(3)] for body in self.bodies])

    def friction(self, u: Array) -> Array:
        """What friction takes, on all bodies (size,)."""
        return sum((self._rubbing(tie, u) for tie in self.ties), np.zeros(self.size))

    def energies(self, twist: Array, gravity: Array) -> tuple[float, float]:
        u = self.velocities(twist)
        fallen = sum(body.mass * gravity @ body.centre for body in self.bodies)
        return float(u @ (self.mass + self.motors) @ u) / 2, -float(fallen)

    def speeds(self, twist: Array) -> Array:
        """Of the drives, in the order of Q."""
        return self.drives @ self.velocities(twist)

    def _with_platform(self, platform: Array, bends: Array) -> Array:
        rest = np.linalg.solve(self.rows[:, :-6], -bends - self.rows[:, -6:] @ platform)
        return np.r_[rest, platform]

    def _bends(self, u: Array) -> Array:
        move = Move(self.bodies, u)
        return np.array([law.bend(move) for law in self.laws])

    def _of_load(self, load: Array) -> Array:
        arm = self.origin - self.bodies[-1].centre
        return np.r_[np.zeros(self.size - 6), load[:3], load[3:] + np.cross(arm, load[:3])]

    def _rubbing(self, tie: Tie, u: Array) -> Array:
        """Viscous and Coulomb friction of one joint against its motion."""
        joint = tie.element
        rows = np.array([law.row(self.bodies) for law in tie.coordinates]).reshape(-1, self.size)
        rates = _lever(joint) * (rows @ u)
        sizes = np.full(len(rates), np.linalg.norm(rates)) if isinstance(joint, Spherical) else np.abs(rates)
        sizes = np.sqrt(sizes**2 + self.creep**2)
        forces = (getattr(joint, "damping", None) or 0.0) * rates
        forces += (getattr(joint, "friction", None) or 0.0) * np.divide(rates, sizes, out=np.zeros_like(rates), where=sizes > 0)
        return rows.T @ (_lever(joint) * forces)

    def _against(self, tie: Tie, u: Array, rise: Array) -> Array:
        """Friction and motor of one joint against its motion."""
        found = self._rubbing(tie, u)
        for law in tie.coordinates:
            row = law.row(self.bodies)
            found += row * _reflected(tie.element) * (row @ rise + law.bend(Move(self.bodies, u)))
        return found

    def _found(self, u: Array, rise: Array, multipliers: Array, forces: Array) -> Found:
        move, first, wrenches = Move(self.bodies, u), 0, []
        for k, tie in enumerate(self.ties):
            held = multipliers[first : first + len(tie.laws)] @ self.rows[first : first + len(tie.laws)]
            first += len(tie.laws)
            given = sum((forces[rank] * self.drives[rank] for rank, place in enumerate(self.driven) if place == k), 0.0)
            total = (held + given - self._against(tie, u, rise))[6 * tie.second : 6 * tie.second + 6]
            moment = total[3:] + np.cross(self.bodies[tie.second].centre - tie.place, total[:3])
            wrenches.append(np.r_[tie.axes.T @ total[:3], tie.axes.T @ moment])
        drives = self.drives @ rise + [self.ties[k].coordinates[0].bend(move) for k in self.driven]
        arm, spin = self.origin - self.bodies[-1].centre, u[-3:]
        centre = rise[-6:-3] + np.cross(rise[-3:], arm) + np.cross(spin, np.cross(spin, arm))
        return Found(np.r_[centre, rise[-3:]], forces, np.array(wrenches), np.asarray(drives))


def _tie(
    name: str, element: Element, frame: Frame, beyond: Frame, coordinate: Any, told: Frame, first: int, second: int
) -> Tie:
    before, after = _numbers(frame.origin), _numbers(beyond.origin)
    axes = np.stack([_numbers(v) for v in frame[1:]], axis=1)
    together: list[Law] = [Gap(first, second, n, before, before) for n in np.eye(3)]
    welded: list[Law] = [Square(first, second, axes[:, k], axes[:, (k + 1) % 3]) for k in range(3)]
    laws, coordinates = together, []
    if isinstance(element, Drivable) and element.locked is not None:
        laws = together + welded
    elif isinstance(element, Prismatic):
        n = axes @ element.axis
        laws = [*welded, *(Gap(first, second, across, before, after) for across in _across(n))]
        coordinates = [Gap(first, second, n, before, after)]
    elif isinstance(element, Curvilinear | Revolute):
        n = axes[:, 2] if isinstance(element, Curvilinear) else axes @ element.axis
        laws = [*together, *(Square(first, second, n, across) for across in _across(n))]
        coordinates = [Rate(first, second, n, first)]
    elif isinstance(element, Universal):
        turned = frame.turn(element.axes[0], coordinate[0])
        n, m = axes @ element.axes[0], _numbers(turned.direction(element.axes[1]))
        laws = [*together, Square(first, second, n, m)]
        coordinates = [Rate(first, second, n, first), Rate(first, second, m, second)]
    elif isinstance(element, Spherical):
        coordinates = [Rate(first, second, n, first) for n in np.eye(3)]
    return Tie(
        name, element, second, _numbers(told.origin), np.stack([_numbers(v) for v in told[1:]], axis=1), laws, coordinates
    )


def _body(given: Parts) -> Body:
    """Parts as one body; one without mass has its centre where its first part stands."""
    parts = []
    for mass, frame in given:
        if float(mass.mass) > 0:
            turn, place = np.array(frame.matrix(), dtype=float), _numbers(frame.origin)
            centre, about = _numbers(mass.moment) / float(mass.mass), np.array(mass.inertia.matrix(), dtype=float)
            about = about - float(mass.mass) * _spread(centre)
            parts.append((float(mass.mass), place + turn @ centre, turn @ about @ turn.T))
    total = sum(m for m, _, _ in parts)
    if total == 0:
        return Body(0.0, _numbers(given[0][1].origin), np.zeros((3, 3)))
    centre = sum(m * c for m, c, _ in parts) / total
    return Body(total, centre, sum(about + m * _spread(c - centre) for m, c, about in parts))


def _spread(arm: Array) -> Array:
    return (arm @ arm) * np.eye(3) - np.outer(arm, arm)


def _across(n: Array) -> Array:
    """Two unit vectors at right angles to a unit vector and to each other."""
    return np.linalg.svd(n[None])[2][1:]


def _spins(bodies: list[Body], first: int, second: int, along: Array) -> Array:
    row = np.zeros(6 * len(bodies))
    for body, sign in ((first, -1.0), (second, 1.0)):
        if body != GROUND:
            row[6 * body + 3 : 6 * body + 6] += sign * along
    return row


def _lever(joint: Element) -> float:
    return float(joint.radius) if isinstance(joint, Curvilinear) else 1.0


def _reflected(joint: Element) -> float:
    moves = isinstance(joint, Drivable) and joint.locked is None
    return float(joint.reflected_inertia or 0.0) * _lever(joint) ** 2 if moves else 0.0


def _numbers(v: Any) -> Array:
    return np.array([float(c) for c in v])

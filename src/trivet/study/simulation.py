"""A machine let go: how it moves under its weight, a load, and drives that give way as springs or push with constant forces."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.dynamics.batch import Case, drive_motion, equations
from trivet.dynamics.bodies import Bodies
from trivet.dynamics.equations import State
from trivet.dynamics.integration import Acting, Balance, Steps, advance, recorded, start
from trivet.errors import InputError, NoResultError, nearest
from trivet.kinematics.approach import chain_gap
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.mode import closed_form_signs
from trivet.kinematics.report import joint_states, shortfall, travel_excess
from trivet.kinematics.singularity import singularity
from trivet.model import Machine
from trivet.space.batches import in_batches
from trivet.space.frame import Frame
from trivet.space.screw import Twist
from trivet.space.vector import ZERO, Vec
from trivet.study.dynamics import Loading, require_inertia, three, without_jumps
from trivet.study.machines import MachineLike, choose
from trivet.study.pose import PoseReport, pose

Array = NDArray[Any]
Law = Literal["springs", "hold", "free"]
LAWS = ("springs", "hold", "free")

PIECE = 50
"""Most samples per call of the integrator; between calls progress is told and limits are looked at."""
CALL = 10_000
"""Steps per call, about."""
MOST_STEPS = 100_000_000
"""Steps of a run; as many take hours."""
MOST_SAMPLES = 200_000

STEP = 0.1
"""Longest step, in radians of the fastest vibration."""
LONGEST_STEP = 1.0
"""Step above which the fastest vibration would be drawn wrong, in radians of it."""
LONGEST_FREE = 0.01
"""Longest step (s) where nothing vibrates."""
TOLERANCE = 1e-10
"""Relative error per step."""
CREEP = 1e-4
"""Speed (m/s, rad/s) around which Coulomb friction passes through zero."""
KEPT = 1e-6
"""Error of the energy balance, relative to what moved, at which a run has met what it cannot pass."""
ROUNDING = 100 * float(np.finfo(float).eps)
"""Of the energies that are balanced, relative to them: weight counts from {O}, and slow motions move far less."""
NEAR = 1e-2
"""Lever of a drive, over the characteristic length or one, below which a stuck run is said to be at a Type 1 singularity."""
LEAST_ENERGY = 1e-15
"""Energy (J) below which nothing moved."""
CHECKS = 20
"""Times at which the loops are closed once more, joint by joint."""

_NONE = (0.0, 0.0, 0.0)

LAW_WORDS: Mapping[Law, str] = {
    "springs": "drives are springs",
    "hold": "drives hold the weight as at the start",
    "free": "drives are free",
}


@dataclass(frozen=True)
class Simulation:
    """A run; all in SI and {O}, actuators in the order of Q, arrays over n times."""

    at: PoseReport
    """How it began."""
    law: Law
    loading: Loading
    time: Array
    """(n,), s."""
    state: State
    """Poses and twists of the platform, components (n,)."""
    coordinates: Array
    """(n, 6) of the drives, m and rad; angles without jumps."""
    forces: Array
    """(n, 6) of the drives, N or N m."""
    balance: Balance
    """Energies (n,), J."""
    frequencies: Array
    """(6,) natural frequencies on the drives' springs at the beginning, Hz; zero where nothing holds."""
    steps: int
    """How many steps the integrator took."""
    longest_step: float
    """s."""
    ended: str | None
    """Why it ended before its time, or None."""

    @property
    def machine(self) -> Machine:
        """The machine."""
        return self.at.machine

    @property
    def mode(self) -> str:
        """Its working mode."""
        return self.at.mode

    @property
    def actuators(self) -> list[str]:
        """Names of the actuated joints."""
        return self.at.actuators

    @cached_property
    def drift(self) -> Array:
        """(n,): how far the energy balance is off, relative to the greatest energy that moved."""
        total = self.balance.total
        moving = np.max(self.balance.kinetic), np.ptp(self.balance.potential), np.ptp(self.balance.springs)
        return np.asarray((total - total[0]) / max(LEAST_ENERGY, *(float(size) for size in moving)))

    @cached_property
    def gap(self) -> float:
        """Greatest gap (m) of a chain walked joint by joint to its platform joint, at times over the run."""
        worst = 0.0
        signs = closed_form_signs(self.machine, self.mode)
        for k in np.unique(np.linspace(0, len(self.time) - 1, CHECKS).astype(int)):
            frame = Frame(*(Vec(*(float(c[k]) for c in v)) for v in self.state.pose))
            worst = max(worst, chain_gap(self.machine, frame, self.coordinates[k], signs))
        return worst


def simulate(
    machine: MachineLike,
    duration: float,
    position: Sequence[float] | None = None,
    azimuth: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    *,
    velocity: Sequence[float] = _NONE,
    angular_velocity: Sequence[float] = _NONE,
    law: Law = "springs",
    forces: Mapping[str, float] | None = None,
    loading: Loading | None = None,
    mode: str | None = None,
    samples: int = 1000,
    step: float | None = None,
    anyway: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Simulation:
    """How a machine moves from a pose and a velocity on.

    Args:
        machine: machine, name or file.
        duration: s.
        position, azimuth, tilt, roll: the pose from which it starts, as for `pose`.
        velocity, angular_velocity: of the platform at the start, at its centre in {O} (m/s, rad/s).
        law: what the drives do: "springs" of their stiffness about where they start, on top of what holds its weight there;
            "hold", those forces alone; "free", nothing.
        forces: constant forces of drives (N, N m) besides, by name.
        loading: weight, and a load that acts from the start on; the weight of a machine that stands upright when not given.
        mode: working mode; the machine's own when not given.
        samples: times at which it is recorded.
        step: longest step of the integrator (s); STEP of the fastest vibration when not given.
        anyway: go on where a joint is outside its travel.
        progress: called with how many samples of how many are done.

    Returns:
        The run; where a joint reached the end of its travel or a chain was stretched it ends there, and `ended` says so.

    Raises:
        InputError: for a machine with a chain without closed form, or other than six drives; for a drive without stiffness that
            should be a spring; for a step too large for the fastest vibration.
        NoResultError: when the machine does not reach the pose from which it should start, or that is singular.
    """
    chosen = choose(machine)
    if not (duration > 0 and math.isfinite(duration)):
        raise InputError(f"duration: {duration:g} s; must be greater than zero")
    if not 2 <= samples <= MOST_SAMPLES:
        raise InputError(f"samples: {samples}; between 2 and {MOST_SAMPLES}")
    signs = closed_form_signs(chosen, mode)
    at = pose(chosen, position, azimuth, tilt, roll, mode=mode, anyway=anyway)
    require_inertia(at)
    twist = Twist(Vec(*three("velocity", velocity)), Vec(*three("angular velocity", angular_velocity)))
    found = Loading() if loading is None else loading
    acting = _acting(at, law, found, forces or {})
    fastest = _frequencies(at, acting)
    steps = _steps(duration, step, float(fastest.max()))
    run = _Run(at, signs, acting, steps, anyway)
    begun = np.asarray(start(jnp.array([*twist.linear, *twist.angular], dtype=float)))
    times, unknowns, ended = run.through(begun, np.linspace(0.0, duration, samples), progress)
    seen = jax.tree.map(np.asarray, recorded(run.bodies, run.signs, acting, unknowns))
    coordinates = without_jumps(chosen, seen.coordinates)
    return Simulation(
        at, law, found, times, seen.state, coordinates, seen.forces, seen.balance, fastest / (2 * math.pi),
        run.taken, float(steps.longest), ended,
    )  # fmt: skip


class _Run:
    """A run in pieces."""

    def __init__(self, at: PoseReport, signs: Any, acting: Acting, steps: Steps, anyway: bool) -> None:
        self.machine, self.mode, self.anyway = at.machine, at.mode, anyway
        self.bodies = jax.tree.map(jnp.asarray, Bodies.of(at.machine))
        self.signs, self.acting, self.steps = jnp.asarray(signs), acting, steps
        self.taken = 0
        self.total: float | None = None
        self.moved = LEAST_ENERGY

    def through(
        self, unknowns: Array, times: Array, progress: Callable[[int, int], None] | None
    ) -> tuple[Array, Array, str | None]:
        """Times and unknowns, up to the end or to where the machine can go no further, and why it could not."""
        done_times, done, count = [times[:1]], [unknowns[None]], 1
        for wanted, kept in self._calls(times):
            found = self._piece(unknowns, wanted)
            failed = self._fails(found)
            if np.any(failed[1:]):
                time, last, reason = self._narrowed(wanted, found, failed)
                before = [k for k in kept if wanted[k] < time]
                done_times += [wanted[before], np.array([time])]
                done += [found[before], last[None]]
                return np.concatenate(done_times), np.concatenate(done), reason
            done_times.append(wanted[kept])
            done.append(found[kept])
            unknowns, count = found[-1], count + len(kept)
            if progress is not None and kept:
                progress(count, len(times))
        return np.concatenate(done_times), np.concatenate(done), None

    def _calls(self, times: Array) -> Iterator[tuple[Array, list[int]]]:
        """Times per call of the integrator, always PIECE + 1, and which of them are wanted: short calls can be interrupted."""
        span, between = CALL * float(self.steps.longest), times[1] - times[0]
        if between > span:
            parts = math.ceil(between / span)
            for start, end in pairwise(times):
                bounds = np.linspace(start, end, parts + 1)
                for k, (low, high) in enumerate(pairwise(bounds), 1):
                    yield np.linspace(low, high, PIECE + 1), [PIECE] if k == parts else []
            return
        count = int(min(PIECE, span // between))
        for first in range(0, len(times) - 1, count):
            own = times[first : first + count + 1]
            yield np.concatenate([own, np.full(PIECE + 1 - len(own), own[-1])]), list(range(1, len(own)))

    def _piece(self, unknowns: Array, times: Array) -> Array:
        run = advance(self.bodies, self.signs, self.acting, self.steps, jnp.asarray(unknowns), jnp.asarray(times))
        self.taken += int(run.steps)
        return np.asarray(run.unknowns)

    def _fails(self, unknowns: Array) -> Array:
        """Where it got stuck, does not reach, is outside its travel, or has lost energy: at a Type 1 singularity."""
        sound = np.all(np.isfinite(unknowns), axis=1)
        seen = self._recorded(np.where(sound[:, None], unknowns, unknowns[0]))
        balance = seen.balance
        if self.total is None:
            self.total = float(balance.total[0])
        moving = balance.kinetic.max(), np.ptp(balance.potential), np.ptp(balance.springs)
        largest = max(float(np.abs(part).max()) for part in balance)
        lost = np.abs(balance.total - self.total)
        kept = lost < KEPT * max(self.moved, *(float(size) for size in moving)) + ROUNDING * largest
        states = self._states(seen.state.pose)
        outside = np.any(travel_excess(states) > 0, axis=1) & (not self.anyway)
        failed: Array = ~sound | outside | ~kept | ~np.all(states.reach >= 0, axis=1)
        if not np.any(failed):
            self.moved = max(self.moved, *(float(size) for size in moving))
        return failed

    def _recorded(self, unknowns: Array) -> Any:
        return jax.tree.map(np.asarray, recorded(self.bodies, self.signs, self.acting, unknowns))

    def _states(self, pose: Frame) -> Any:
        return in_batches(lambda frames: joint_states(self.machine, frames, self.signs), pose)

    def _narrowed(self, times: Array, found: Array, failed: Array) -> tuple[float, Array, str]:
        """The last time at which all was well, to a millionth of a millionth of the run's piece, and what came then."""
        miss = None
        for _ in range(6):
            k = int(np.argmax(failed[1:])) + 1
            if np.all(np.isfinite(found[k])):
                found_miss = shortfall(self.machine, self._states(self._recorded(found[k][None]).state.pose))
                miss = miss if found_miss is None else found_miss
            times = np.linspace(times[k - 1], times[k], PIECE + 1)
            found = self._piece(found[k - 1], times)
            failed = self._fails(found)
            if not np.any(failed[1:]):
                break
        k = int(np.argmax(failed[1:])) if np.any(failed[1:]) else len(times) - 1
        if miss is None or (self.anyway and miss.joint is not None):
            reason = self._stuck(self._recorded(found[k][None]).state.pose)
        else:
            reason = miss.reason
        return float(times[k]), found[k], f"at t = {times[k]:.6g} s: {reason}"

    def _stuck(self, pose: Frame) -> str:
        """Why a run can go no further at a pose, components (1,), though no limit is in its way."""
        frame = jax.tree.map(lambda c: float(c[0]), pose)
        length = float(self.machine.characteristic_length)
        try:
            levers = singularity(self.machine, frame, self.mode).drives
        except NoResultError:
            levers = ()
        short = [lever for lever in levers if not lever.lever > NEAR * (length if lever.is_angular else 1.0)]
        if levers and not short:
            return "the balance of energy is lost: the steps are too long for this motion; give a shorter --step"
        reach = self._states(pose).reach[0]
        chain = short[0].name.split(".")[0] if short else self.machine.legs[int(np.argmin(reach))].name
        return f"{chain} is stretched or folded, or its carriage on the axis of its guide (a Type 1 singularity)"


def _acting(at: PoseReport, law: Law, loading: Loading, forces: Mapping[str, float]) -> Acting:
    machine, named = at.machine, dict(actuators(at.machine))
    if law not in LAWS:
        raise InputError(f"drives '{law}'{nearest(law, LAWS)}")
    for name, value in forces.items():
        if name not in named:
            raise InputError(f"force of {name}: {machine.name} has no such drive{nearest(name, named)}")
        if not math.isfinite(value):
            raise InputError(f"force of {name}: {value} is no finite number")
    rate = np.zeros(6)
    if law == "springs":
        for k, (name, joint) in enumerate(named.items()):
            if joint.stiffness is None:
                raise InputError(
                    f"{name}: a drive without stiffness is rigid and no spring; give {name.partition('.')[2]}.stiffness, "
                    "or let the drives hold or be free"
                )
            rate[k] = float(joint.stiffness) * float(joint.lever) ** 2
    given = np.array([float(forces.get(name, 0.0)) for name in named])
    kind = singularity(machine, at.frame, at.mode or None).type
    if kind in (1, 3) or (kind == 2 and law != "free"):
        raise NoResultError(f"{machine.name}: no run starts at a Type {kind} singularity; choose another pose to start from")
    if law != "free":
        still = Twist(ZERO, ZERO)
        case, state = Case(machine, at.signs, loading.gravity), State(at.frame, still)
        given = given + drive_motion(case, state, still).force[0]
    coordinates = [float(row.coordinate) for row in at.joints if row.actuated]
    order = [row.name for row in at.joints if row.actuated]
    rest = np.array([coordinates[order.index(name)] for name in named])
    return Acting(
        gravity=_array(loading.gravity),
        force=_array(loading.force),
        moment=_array(loading.moment),
        point=_array(loading.point_on(machine)),
        drive_force=_array(given),
        rate=_array(rate),
        rest=_array(rest),
        creep=_array(CREEP),
        beginning=jax.tree.map(_array, at.frame),
    )


def _array(value: Any) -> jax.Array:
    return jnp.asarray(value, dtype=float)


def _frequencies(at: PoseReport, acting: Acting) -> Array:
    """(6,) of the platform on the drives' springs, rad/s."""
    import scipy.linalg

    task = equations(Case(at.machine, at.signs), State(at.frame, Twist(ZERO, ZERO))).task
    jacobian, inertia = task.jacobian[0], task.inertia[0]
    squares = scipy.linalg.eigh(jacobian.T @ (np.asarray(acting.rate)[:, None] * jacobian), inertia, eigvals_only=True)
    return np.sqrt(np.maximum(squares, 0.0))


def _steps(duration: float, step: float | None, fastest: float) -> Steps:
    longest = STEP / fastest if fastest > 0 else min(duration / 100, LONGEST_FREE)
    if step is not None:
        if not (step > 0 and math.isfinite(step)):
            raise InputError(f"step: {step:g} s; must be greater than zero")
        bound = LONGEST_STEP / fastest if fastest > 0 else duration / 10
        if step > bound:
            what = f"the fastest vibration, {fastest / (2 * math.pi):.4g} Hz" if fastest > 0 else f"a run of {duration:g} s"
            raise InputError(f"step: {step:g} s is too large for {what}; at most {bound:.3g} s, {longest:.3g} s when not given")
        longest = step
    if duration / longest > MOST_STEPS:
        raise InputError(
            f"duration: {duration:g} s asks for {duration / longest:.2g} steps of {longest:.3g} s; at most {MOST_STEPS:.0e}, "
            f"which is {MOST_STEPS * longest:.3g} s"
        )
    return Steps(jnp.asarray(longest), jnp.asarray(TOLERANCE))

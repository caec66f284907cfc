"""The peer for speed: best-roll K_xx of one machine, one mode, one quantity, fused by hand in numba.

What a good engineer would write for just this map of the machine with radial slides on a circular guide: inverse kinematics,
limits, the two or five compliances that K_xx needs, three chains, nothing general.  Euler-Bernoulli, SI.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from trivet.model import Machine
from trivet.space.surface import Surface


def arguments(machine: Machine, surface: Surface, rolls: int) -> tuple[Any, ...]:
    """What the loop takes, out of the machine file."""
    chain = machine.chains["leg"]
    guide, slide, hinge, link, _ = chain.elements
    steel, tube = machine.materials["steel"], machine.sections["tube"].properties(machine.materials["steel"].poisson_ratio)
    gamma = 2 * math.pi / rolls * np.arange(rolls)
    azimuths = 2 * math.pi / 3 * np.arange(3)
    return (
        *np.ascontiguousarray(surface.position.T), surface.azimuth, surface.tilt, np.cos(gamma), np.sin(gamma),
        chain.platform_joint.radius * np.cos(azimuths), chain.platform_joint.radius * np.sin(azimuths),
        guide.radius, link.length, 1 / guide.stiffness, 1 / slide.stiffness,
        1 / (steel.youngs_modulus * tube.area), 1 / (steel.youngs_modulus * tube.inertia_z), 1 / (steel.shear_modulus * tube.torsion),
        *slide.travel, math.sin(hinge.travel[0]), math.sin(hinge.travel[1]),
    )  # fmt: skip


def make(clamped: bool, parallel: bool = True) -> Callable[..., Any]:
    """The loop, with ball joints clamped or free, over all cores or on one; gives the best K_xx per point, or -1."""
    # ruff: noqa: E501

    @numba.njit(parallel=parallel, fastmath=True, error_model="numpy")
    def best(
        x,
        y,
        z,
        azimuth,
        tilt,
        cos_roll,
        sin_roll,
        ax,
        ay,
        foot,
        length,
        by_guide,
        by_slide,
        by_area,
        by_inertia,
        by_torsion,
        low,
        high,
        sine_low,
        sine_high,
    ):  # type: ignore[no-untyped-def]
        found = np.empty(x.size)
        link_axial, link_bend, link_twist = length * by_area, length * by_inertia, length * by_torsion
        link_end, link_slope = length * length * link_bend / 3, length * link_bend / 2
        by_length = 1 / length
        for i in numba.prange(x.size):
            ca, sa, cb, sb = math.cos(azimuth[i]), math.sin(azimuth[i]), math.cos(tilt[i]), math.sin(tilt[i])
            top = -1.0
            for j in range(cos_roll.size):
                c, s = cos_roll[j], sin_roll[j]
                ux, uy, uz = ca * cb * c - sa * s, sa * cb * c + ca * s, -sb * c
                vx, vy, vz = -ca * cb * s - sa * c, -sa * cb * s + ca * c, sb * s
                total, inside = 0.0, True
                for k in range(3):
                    px = x[i] + ax[k] * ux + ay[k] * vx
                    py = y[i] + ax[k] * uy + ay[k] * vy
                    pz = z[i] + ax[k] * uz + ay[k] * vz
                    square = px * px + py * py
                    rho = math.sqrt(square)
                    cc, ss = px * px / square, py * py / square
                    sine = pz * by_length
                    cosine = math.sqrt(1 - sine * sine)
                    b = rho + length * cosine - foot
                    inside = inside & (b >= low) & (b <= high) & (sine >= sine_low) & (sine <= sine_high)
                    arm = length * cosine
                    axial, bend, twist = b * by_area, b * by_inertia, b * by_torsion
                    end, slope = b * b * bend / 3, b * bend / 2
                    # Along the link, the only force in the plane that a passive hinge leaves free of other play.
                    along = link_axial + cosine * cosine * (by_slide + axial) + end * sine * sine
                    across = by_guide + link_end + end - 2 * slope * arm + bend * arm * arm + twist * pz * pz
                    if not clamped:
                        total += ss / across + cosine * cosine * cc / along
                    else:
                        cross = sine * cosine * (end - by_slide - axial)
                        normal = link_end + sine * sine * (by_slide + axial) + end * cosine * cosine
                        radial = (cosine * cosine * normal + 2 * cosine * sine * cross + sine * sine * along) / (
                            along * normal - cross * cross
                        )
                        f1, f2 = -twist * pz - link_slope * sine, slope - bend * arm - link_slope * cosine
                        m11 = twist + link_twist * cosine * cosine + link_bend * sine * sine
                        m22 = bend + link_twist * sine * sine + link_bend * cosine * cosine
                        m12 = sine * cosine * (link_bend - link_twist)
                        held = across - (f1 * f1 * m22 - 2 * f1 * f2 * m12 + f2 * f2 * m11) / (m11 * m22 - m12 * m12)
                        total += cc * radial + ss / held
                if inside and total > top:
                    top = total
            found[i] = top
        return found

    return best

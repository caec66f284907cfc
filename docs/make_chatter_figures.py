"""Draw the figures of docs/chatter.md.

python docs/make_chatter_figures.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import trivet
from trivet.show.palette import BLUE, ORANGE
from trivet.study.lobes import RPM
from trivet.study.pathfile import PathFile, PathPose

FIGURES = Path(__file__).parent / "figures"
MATERIAL = "aluminium-7075-t6"


def lobes_figure() -> None:
    cut = trivet.Cut.of(0.016, 4, 0.004, "down", material=MATERIAL)
    trivet.figure(trivet.lobes("azulay", tilt=np.radians(20), cut=cut), FIGURES / "lobes.png", overwrite=True)


def path_figure() -> None:
    poses = [PathPose((0.0, 0.0, 0.125), 0.0, np.radians(tilt)) for tilt in range(0, 31)]
    cut = trivet.Cut.of(0.016, 4, 0.004, "down", material=MATERIAL)
    trivet.figure(trivet.lobes_along("azulay", PathFile(poses), cut=cut), FIGURES / "lobes-path.png", overwrite=True)


def check_figure() -> None:
    figure = Figure(figsize=(11.5, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, radial, top in zip(figure.subplots(1, 2), (0.004, 0.001), (8, 30), strict=True):
        cut = trivet.Cut.of(0.016, 4, radial, "down", material=MATERIAL)
        one = trivet.lobes("azulay", tilt=np.radians(20), cut=cut, slowest=4000 * RPM)
        checked = one.check(60)
        axes.plot(one.speeds / RPM, np.minimum(one.depth * 1e3, 2 * top), color=BLUE, label="lobes (zero order)")
        axes.plot(
            [row.speed / RPM for row in checked], [row.semi_discretisation * 1e3 for row in checked], "o", color=ORANGE,
            markersize=4, label="semi-discretisation",
        )  # fmt: skip
        axes.set_ylim(0, top)
        axes.set_title(f"radial depth {radial * 1e3:g} mm of 16 mm, {cut.engaged:.2f} teeth in the material", fontsize=10)
        axes.set_xlabel("spindle speed, rpm")
        axes.grid(color="#DDDDDD", linewidth=0.6)
    axes = figure.axes[0]
    axes.set_ylabel("stable depth of cut, mm")
    axes.legend(fontsize=9, loc="upper right")
    figure.savefig(FIGURES / "lobes-check.png", dpi=100)


if __name__ == "__main__":
    lobes_figure()
    path_figure()
    check_figure()

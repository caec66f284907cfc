"""A cone of directions as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from trivet.show.cone import ROOM, Disc, compass, title
from trivet.show.plan import value_label
from trivet.study.cone import ConePlan


def write_picture(plan: ConePlan, disc: Disc, path: Path) -> None:
    """Write the cone seen from above."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(8, 7.6), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.suptitle(title(plan, disc), x=0.02, ha="left", fontsize=12)
    axes = canvas.subplots()
    far = (-ROOM * disc.edge, ROOM * disc.edge)
    axes.set(aspect="equal", xlim=far, ylim=far, xlabel="tilt towards x, °", ylabel="tilt towards y, °")
    axes.spines[["top", "right"]].set_visible(False)
    mesh = _disc(disc, axes)
    axes.plot(0, 0, "+", color="black", markersize=12, markeredgewidth=1.5, linestyle="", label="level")
    look: dict[str, Any] = {"color": "black", "markerfacecolor": "white", "markersize": 7, "linestyle": "", "zorder": 4}
    axes.plot(*disc.worst, "D", label=f"worst, {disc.least:.3g}", **look)
    axes.plot([], [], color="grey", marker=">", label="x axis of the platform, seen from above")
    for name, x, y, side, height in compass(disc):
        axes.text(x, y, name, ha=side, va=height, rotation=-90 if name.startswith("azimuth") else 0, fontsize=9)
    canvas.legend(loc="outside lower left", frameon=False, fontsize=9, ncols=4, columnspacing=1.2)
    canvas.colorbar(mesh, ax=axes, shrink=0.8, label=value_label(plan.rules))
    canvas.savefig(path, format="png", dpi=120)


def _disc(disc: Disc, axes: Any) -> Any:
    """Colours up to the edge, and the arrows."""
    from matplotlib.patches import Circle

    rim = Circle((0, 0), disc.edge, facecolor="none", edgecolor="black", linewidth=2, zorder=3)
    axes.add_patch(rim)
    axes.plot([], [], color="black", linewidth=2, label="edge of the cone")
    mesh = axes.pcolormesh(disc.across, disc.across, disc.value, cmap="cividis", vmin=0, shading="gouraud")
    mesh.set_clip_path(rim)
    start, tip = disc.arrows[:, 0], disc.arrows[:, 1]
    axes.quiver(*start.T, *(tip - start).T, color="white", angles="xy", scale_units="xy", scale=1, width=0.004)
    return mesh

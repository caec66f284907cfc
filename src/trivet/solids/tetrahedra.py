"""A STEP file as quadratic tetrahedra, by gmsh (Geuzaine and Remacle, Int. J. Numer. Methods Eng. 79:1309, 2009).

Run as a program of its own, `python -m trivet.solids.tetrahedra FILE FINENESS RESULT.npz BYTES`: gmsh is not thread-safe and
takes over signals, and a hostile file may crash it or keep it busy for ever.  It gets so many bytes of address space, and no
mesh is made that would have too many nodes.  What it cannot do it says on one line of standard output, with exit code 2.
"""

from __future__ import annotations

import resource
import sys
from typing import Any

import numpy as np

from trivet.solids.grid import MOST_NODES

PER_CUBE = 12.0
"""Nodes in the cube of an edge: 1.4 for every tetrahedron, of which 8.5 fill it; meshes of parts have 2 to 4 times as many."""
ACROSS = 1.5
"""Edge of a tetrahedron, against twice the volume by the surface (the wall, in what is thin), at fineness 1."""
ROUND = 12
"""Edges around a circle at fineness 1."""
NEAR = 1e-6
"""Against the length, how far from an end a flat face may lie."""
ASIDE = 1e-3
"""Distance of the middle of an end from the axis, against the length, up to which it lies on it."""
MARGIN = 1e-7
"""By which gmsh's boxes are larger than what is in them, m."""
TETRAHEDRON, PLANE = 11, "Plane"
"""gmsh's number for those with ten nodes, and its name of a flat face."""
SYSTEM = {
    "libGLU.so.1": "libglu1-mesa", "libGL.so.1": "libgl1", "libXft.so.2": "libxft2", "libXcursor.so.1": "libxcursor1",
    "libXinerama.so.1": "libxinerama1", "libXrender.so.1": "libxrender1", "libXfixes.so.3": "libxfixes3",
    "libXext.so.6": "libxext6", "libX11.so.6": "libx11-6", "libfontconfig.so.1": "libfontconfig1", "libgomp.so.1": "libgomp1",
}  # fmt: skip
"""Packages of Debian with the libraries that the wheel of gmsh does not bring."""


class CannotError(Exception):
    """Why there is no mesh, in words that go behind the name of the file."""


def loaded() -> Any:
    """The module gmsh."""
    try:
        import gmsh
    except ImportError:
        raise CannotError("STEP files need gmsh; install it with: pip install 'trivet[solids]'") from None
    except OSError as error:
        library = str(error).partition(":")[0]
        package = SYSTEM.get(library)
        hint = f"; install it, on Debian with: apt-get install {package}" if package else ""
        raise CannotError(f"gmsh cannot be loaded: {error}{hint}") from None
    return gmsh


def meshed(file: str, fineness: float) -> dict[str, np.ndarray]:
    """Nodes (3, n) in m, tetrahedra (10, e) in the order of scikit-fem, and the edge that was asked for."""
    gmsh = loaded()
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        try:
            gmsh.model.occ.importShapes(file)
            gmsh.model.occ.synchronize()
        except Exception as error:
            raise CannotError(f"cannot be read as a STEP file: {error}") from None
        volumes = gmsh.model.getEntities(3)
        if len(volumes) != 1:
            found = f"{len(volumes)} solids" if volumes else "no solid"
            raise CannotError(f"has {found}; expected one, without gaps in its surface")
        _check_ends(gmsh)
        size = _size(gmsh, volumes[0][1], fineness)
        _make(gmsh, size, fineness)
        return _result(gmsh) | {"size": np.array(size)}
    finally:
        gmsh.finalize()


def _check_ends(gmsh: Any) -> None:
    """The part begins at x = 0, and flat faces end it on both sides, whose middles lie on the axis."""
    boxes = {tag: gmsh.model.occ.getBoundingBox(2, tag) for _, tag in gmsh.model.getEntities(2)}
    boxes = {tag: (*(low + MARGIN for low in box[:3]), *(high - MARGIN for high in box[3:])) for tag, box in boxes.items()}
    flat = {tag: box for tag, box in boxes.items() if gmsh.model.getType(2, tag) == PLANE}
    low, high = min(box[0] for box in boxes.values()), max(box[3] for box in boxes.values())
    margin = NEAR * (high - low)
    for end, at in (("near", low), ("far", high)):
        faces = [tag for tag, box in flat.items() if abs(box[0] - at) < margin and abs(box[3] - at) < margin]
        if not faces:
            raise CannotError(
                f"has no flat face across x at its {end} end, x = {1e3 * at:.6g} mm; the part's axis runs along x, from 0 to "
                "its length, and ends in flat faces"
            )
        _check_middle(gmsh, end, faces, ASIDE * (high - low))
    if abs(low) > margin:
        raise CannotError(f"begins at x = {1e3 * low:.6g} mm; the part's axis runs along x, from 0 to its length")


def _check_middle(gmsh: Any, end: str, faces: list[int], most: float) -> None:
    """The middle of an end, which may have several faces, lies at most so far (m) from the axis."""
    areas = np.array([gmsh.model.occ.getMass(2, tag) for tag in faces])
    _, y, z = areas @ np.array([gmsh.model.occ.getCenterOfMass(2, tag) for tag in faces]) / areas.sum()
    if not np.hypot(y, z) <= most:
        raise CannotError(
            f"lies beside its axis: the middle of its {end} end, y = {1e3 * y:.3f} mm and z = {1e3 * z:.3f} mm, is "
            f"{1e3 * np.hypot(y, z):.3f} mm from it; move the part so that the x axis passes through the middles of both ends, "
            f"within {1e3 * most:.2g} mm"
        )


def _size(gmsh: Any, volume: int, fineness: float) -> float:
    """Edge of the elements, m."""
    surface = sum(gmsh.model.occ.getMass(2, tag) for _, tag in gmsh.model.getEntities(2))
    inside = gmsh.model.occ.getMass(3, volume)
    if not (inside > 0 and surface > 0):
        raise CannotError("has a solid without volume; is its surface closed?")
    size = float(ACROSS * 2 * inside / surface / fineness)
    _check_nodes(PER_CUBE * inside / size**3, size)
    return size


def _check_nodes(least: float, size: float) -> None:
    """Refuse a mesh that has more nodes than a part may have, before it is made."""
    if least > MOST_NODES:
        raise CannotError(
            f"takes {least:,.0f} nodes or more, with elements of {1e3 * size:.3g} mm; at most {MOST_NODES:,}, give a coarser "
            "mesh (--fineness) or a simpler part"
        )


def _make(gmsh: Any, size: float, fineness: float) -> None:
    for name, value in (
        ("MeshSizeMax", size),
        ("MeshSizeFromCurvature", ROUND * fineness),
        ("ElementOrder", 2),
        ("HighOrderOptimize", 2),
        ("RandomSeed", 1),
    ):
        gmsh.option.setNumber(f"Mesh.{name}", value)
    try:
        gmsh.model.mesh.generate(2)
        _check_nodes(len(gmsh.model.mesh.getNodes()[0]), size)  # those of the surface, small ones around small circles
        gmsh.model.mesh.generate(3)
    except CannotError:
        raise
    except Exception as error:
        raise CannotError(f"cannot be meshed: {error}") from None


def _result(gmsh: Any) -> dict[str, np.ndarray]:
    tags, places, _ = gmsh.model.mesh.getNodes()
    _, own = gmsh.model.mesh.getElementsByType(TETRAHEDRON)
    if not len(own):
        raise CannotError("cannot be meshed: gmsh made no tetrahedra")
    used, numbers = np.unique(own, return_inverse=True)
    where = np.argsort(tags)
    points = places.reshape(-1, 3)[where[np.searchsorted(tags, used, sorter=where)]]
    # gmsh counts the edges 2-3 and 1-3 the other way round.
    elements = numbers.reshape(-1, 10)[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
    return {"points": points.T, "elements": elements.T}


def main() -> int:
    """Write the mesh, or say why there is none."""
    file, fineness, result, memory = sys.argv[1:]
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    soft = int(memory) if hard == resource.RLIM_INFINITY else min(int(memory), hard)
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
    try:
        np.savez(result, allow_pickle=False, **meshed(file, float(fineness)))
    except CannotError as error:
        print(error)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

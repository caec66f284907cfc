"""Bodies from mesh files (trimesh), as their convex hulls (SciPy), by coal: signed distances one pose and one pair at a time.

coal is the successor of FCL (J. Pan, S. Chitta, D. Manocha, A general purpose library for collision and proximity queries, ICRA
2012).
"""

from __future__ import annotations

import os
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, one_line
from trivet.reach.distance import Box, Capsule
from trivet.space.frame import Frame

Array = NDArray[Any]

LARGEST_FILE = 50_000_000
"""Bytes."""
MOST_POINTS, MOST_CORNERS = 500_000, 20_000
"""Vertices of a mesh, and of its hull."""
LARGEST, SMALLEST = 1e4, 1e-6
"""Of a mesh, m."""
SCALE = {"mm": 1e-3, "m": 1.0}
_MISSING = "shapes from meshes need coal and trimesh; install them with: pip install 'trivet[meshes]'"


class Solid(NamedTuple):
    """The convex hull of a mesh, in a frame."""

    frame: Frame


def hull(file: str, unit: str) -> Any:
    """The convex hull of a mesh file (STL, OBJ, PLY, …), in m.

    Raises:
        InputError: when the file cannot be read, is too large or has no volume, or coal or trimesh is not installed.
    """
    try:
        size, changed = os.stat(file).st_size, os.stat(file).st_mtime_ns
    except (OSError, ValueError) as error:  # a name with a NUL in it
        raise InputError(f"{one_line(file)}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not file.lower().endswith((".stl", ".obj", ".ply")):
        raise InputError(f"{file}: a mesh is a file of STL, OBJ or PLY")
    if not os.path.isfile(file):
        raise InputError(f"{file}: is no file")
    if size > LARGEST_FILE:
        raise InputError(f"{file}: {size / 1e6:.0f} MB; a mesh has {LARGEST_FILE / 1e6:.0f} MB at most")
    return _hull(os.path.abspath(file), unit, changed)


@lru_cache(maxsize=100)
def _hull(file: str, unit: str, changed: int) -> Any:
    from scipy.spatial import ConvexHull, QhullError

    coal, points = _coal(), _vertices(file) * SCALE[unit]
    if len(points) > MOST_POINTS:
        raise InputError(f"{file}: {len(points):,} different vertices; at most {MOST_POINTS:,}, make the mesh simpler")
    if not len(points):
        raise InputError(f"{file}: cannot be read as a mesh (STL, OBJ or PLY), or has no triangles")
    if not np.all(np.abs(points) < LARGEST):
        raise InputError(f"{file}: has a vertex that is not a number, or farther than {LARGEST:g} m from its origin")
    try:
        corners = ConvexHull(points, qhull_options="Qt")
    except (QhullError, ValueError):
        corners = None
    if corners is None or corners.volume < SMALLEST**3:
        raise InputError(f"{file}: a mesh without a volume, or smaller than {SMALLEST:g} m")
    own = np.unique(corners.simplices)
    if len(own) > MOST_CORNERS:
        raise InputError(f"{file}: a hull of {len(own):,} corners; at most {MOST_CORNERS:,}, make the mesh simpler")
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(corners.simplices), len(own))
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for point in points[own]:
        vertices.append(point)
    for row in np.searchsorted(own, corners.simplices):
        triangles.append(coal.Triangle(*(int(k) for k in row)))
    model.addSubModel(vertices, triangles)
    model.endModel()
    model.buildConvexHull(True, "Qt")
    return model.convex


def _vertices(file: str) -> Array:
    """(n, 3) in the unit of the file; none where it cannot be read."""
    trimesh = _trimesh()
    try:
        with open(file, "rb") as stream:
            mesh = trimesh.load(stream, file_type=file.rsplit(".", 1)[1].lower(), force="mesh", process=False)
    except Exception:  # a parser's errors are of any kind
        return np.zeros((0, 3))
    return np.unique(np.asarray(mesh.vertices, dtype=float).reshape(-1, 3), axis=0)


def _trimesh() -> Any:
    try:
        import trimesh
    except ImportError:
        raise InputError(_MISSING) from None
    return trimesh


def _coal() -> Any:
    try:
        import coal
    except ImportError:
        raise InputError(_MISSING) from None
    return coal


def distances(shapes: list[tuple[Any, Any]], pairs: list[tuple[int, int]], count: int) -> Array:
    """Signed distances (n, pairs), m.

    Args:
        shapes: each a `Capsule`, `Box` or `Solid` with components (n,) or numbers, and the hull of a `Solid` or None.
        pairs: of shapes.
        count: n.
    """
    coal = _coal()
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_tolerance = request.epa_tolerance = 1e-9
    request.gjk_max_iterations = request.epa_max_iterations = 1000
    plain = [(jax.tree.map(lambda c: np.broadcast_to(np.asarray(c, dtype=float), (count,)), own), body) for own, body in shapes]
    found = np.empty((count, len(pairs)))
    for k in range(count):
        placed = [_placed(coal, own, body, k) for own, body in plain]
        for column, (a, b) in enumerate(pairs):
            found[k, column] = coal.distance(*placed[a], *placed[b], request, coal.DistanceResult())
    return found


def _placed(coal: Any, own: Any, body: Any, k: int) -> tuple[Any, Any]:
    if isinstance(own, Capsule):
        start, end = (np.array([c[k] for c in point]) for point in (own.start, own.end))
        along = end - start
        length = float(np.linalg.norm(along))
        z = along / length if length > 0 else np.array([0.0, 0.0, 1.0])
        x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
        x /= np.linalg.norm(x)
        turn = np.stack([x, np.cross(z, x), z], axis=1)
        return coal.Capsule(float(own.radius[k]), length), coal.Transform3s(turn, (start + end) / 2)
    frame = own.frame
    turn = np.array([[c[k] for c in axis] for axis in frame[1:]]).T
    where = coal.Transform3s(turn, np.array([c[k] for c in frame.origin]))
    if isinstance(own, Box):
        return coal.Box(*(2 * float(c[k]) for c in own.half)), where
    return body, where

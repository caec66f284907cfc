"""Hidden surfaces by a depth buffer: matplotlib sorts whole triangles, which goes wrong wherever bodies meet."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from trivet.show.shapes import Array

FINER = 2
"""Pixels of the buffer per pixel of the picture, each way; their mean smooths the edges."""


class Facets(NamedTuple):
    """Triangles on the page with one colour each."""

    corners: Array
    """(n, 3, 3): x and y in pixels from the lower left corner, depth away from the eye."""
    colours: Array
    """(n, 3) red, green, blue in 0..1."""
    opacity: float


def render(bodies: list[Facets], width: int, height: int) -> Array:
    """The picture (height, width, 4) of bodies, red, green, blue and opacity in 0..1, its first row on top.

    What is opaque hides what is behind it; of a body that is not, the front is laid over what is behind it.
    """
    depth = np.full((height * FINER, width * FINER), np.inf)
    colour = np.zeros((*depth.shape, 4), dtype=np.float32)
    for body in bodies:
        if body.opacity == 1:
            _fill(body, depth, colour)
    for body in sorted((b for b in bodies if b.opacity < 1), key=lambda b: -b.corners[..., 2].mean()):
        _lay_over(body, depth, colour)
    smooth = colour.reshape(height, FINER, width, FINER, 4).mean(axis=(1, 3))
    # The mean has darkened the edges by the black of what is empty; opacity says by how much.
    smooth[..., :3] /= np.maximum(smooth[..., 3:], 1e-6)
    return np.clip(smooth, 0, 1)[::-1]


def _lay_over(body: Facets, depth: Array, colour: Array) -> None:
    """Draw the front of a body that can be seen through; colours in the buffer are weighted with their opacity."""
    flat = body.corners[..., :2].reshape(-1, 2) * FINER
    limit = (depth.shape[1], depth.shape[0])
    low = np.clip(np.floor(flat.min(axis=0)), 0, limit).astype(int)
    high = np.clip(np.ceil(flat.max(axis=0)) + 1, 0, limit).astype(int)
    patch = (slice(low[1], high[1]), slice(low[0], high[0]))
    own_depth = depth[patch].copy()
    own_colour = np.zeros_like(colour[patch])
    shift = np.array((*(low / FINER), 0.0))
    _fill(body._replace(corners=body.corners - shift), own_depth, own_colour)
    cover = body.opacity * own_colour[..., 3:]
    colour[patch] = own_colour * cover + colour[patch] * (1 - cover)


def _fill(body: Facets, depth: Array, colour: Array) -> None:
    """Draw triangles into a buffer whose first row is at the bottom."""
    rows, columns = depth.shape
    corners = body.corners * (FINER, FINER, 1.0) - (0.5, 0.5, 0.0)
    for (a, b, c), rgb in zip(corners, body.colours, strict=True):
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        x0, x1 = max(math.ceil(min(a[0], b[0], c[0])), 0), min(math.floor(max(a[0], b[0], c[0])), columns - 1)
        y0, y1 = max(math.ceil(min(a[1], b[1], c[1])), 0), min(math.floor(max(a[1], b[1], c[1])), rows - 1)
        if area == 0 or x0 > x1 or y0 > y1:
            continue
        x, y = np.arange(x0, x1 + 1)[None, :], np.arange(y0, y1 + 1)[:, None]
        of_b = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
        of_c = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
        here = a[2] + of_b * (b[2] - a[2]) + of_c * (c[2] - a[2])
        patch = (slice(y0, y1 + 1), slice(x0, x1 + 1))
        # A hair's breadth over the edges, so that no gap opens between neighbours.
        seen = (of_b >= -1e-9) & (of_c >= -1e-9) & (of_b + of_c <= 1 + 1e-9) & (here < depth[patch])
        depth[patch][seen] = here[seen]
        colour[patch][seen] = (*rgb, 1.0)

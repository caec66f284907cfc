"""How tables and figures are worked out, a file per kind.

A kind is a dataclass of its settings, as `paper.toml` has them, with one method, `found(machines, asked, progress)`: names of
machines (with settings of their own, "azulay@link.length=206 mm") and what the paper tells of them in, what comes out back.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from trivet.reproduce.kinds.dimensions import Dimensions
from trivet.reproduce.kinds.dynamic import Dynamic
from trivet.reproduce.kinds.nearest_tilt import NearestTilt
from trivet.reproduce.kinds.prototype import Prototype
from trivet.reproduce.kinds.ring import Ring
from trivet.reproduce.kinds.static import Static
from trivet.reproduce.kinds.tilt import Tilt

AnyWork = Annotated[
    Dimensions | Dynamic | NearestTilt | Prototype | Ring | Static | Tilt,
    Field(discriminator="kind"),
]

"""Study files: machines, what varies of them, what is asked of every design, and over which poses (TOML, with units)."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field, StrictFloat, StrictInt, StrictStr

from trivet.design.sampling import Method
from trivet.model.checked import read_checked
from trivet.model.quantity import Length, PositiveLength, Quantity
from trivet.model.section import STRICT

MOST_VARIABLES, MOST_CHOICES, MOST_MACHINES, MOST_QUANTITIES = 200, 1000, 100, 100
MOST_DESIGNS = 1_000_000_000

Text = Annotated[str, Field(min_length=1, max_length=200)]
Written = StrictStr | StrictInt | StrictFloat
"""A number with its unit; what unit that is depends on what the number is of."""
Count = Annotated[int, Field(strict=True, ge=1, le=MOST_DESIGNS)]
Seed = Annotated[int, Field(strict=True, ge=0, le=2**32 - 1)]
Force = Annotated[float, Quantity("force", "N", "N")]
Moment = Annotated[float, Quantity("moment", "N m", "N m")]
Acceleration = Annotated[float, Quantity("acceleration", "m/s^2", "m/s^2")]


@dataclass(frozen=True)
class GivenVariable:
    """What varies: one number, several that are always equal, several that one factor multiplies, or a choice of several."""

    __pydantic_config__ = STRICT

    of: Text | Annotated[list[Text], Field(min_length=1, max_length=100)] | None = None
    """Key path of a dimension, or of several; they take the variable's value, or their part of a choice; this or `scale`."""
    scale: Text | Annotated[list[Text], Field(min_length=1, max_length=100)] | None = None
    """Key paths of dimensions that the variable's value multiplies."""
    name: Annotated[str, Field(max_length=60)] = ""
    """By which results call it; the key path where nothing is given."""
    low: Written | None = None
    """Least value, or factor; goes with `high`."""
    high: Written | None = None
    """Greatest value, or factor; above `low`."""
    steps: Annotated[int, Field(strict=True, ge=1, le=1_000_000)] | None = None
    """Values that a grid takes of it, both ends included; only a grid needs them."""
    law: Literal["uniform", "log-uniform", "normal"] = "uniform"
    """How it is spread; a normal distribution is about the machine's own value, the first machine's that has one."""
    deviation: Written | None = None
    """Standard deviation of a normal distribution, above zero, in place of `low` and `high`."""
    choices: Annotated[list[Written | list[Written]], Field(min_length=1, max_length=MOST_CHOICES)] | None = None
    """What it may be, in place of `low` and `high`; a list for each choice where several dimensions are named."""


@dataclass(frozen=True)
class GivenPoses:
    """The check points, and how the roll is chosen at each."""

    __pydantic_config__ = STRICT

    steps: Annotated[int, Field(strict=True, ge=1, le=100)] = 10
    """Lattice steps from pole to rim of the hemisphere; 10 gives the paper's 317 points."""
    radius: PositiveLength | None = None
    """Of the hemisphere, above zero; that of each machine's workpiece when not given."""
    height: Length | None = None
    """Of its centre above {O}; that of each machine's workpiece when not given."""
    objective: Text = "K_xx"
    """What the roll maximises."""
    rolls: Annotated[int, Field(strict=True, ge=8, le=100_000)] = 360
    """Rolls that are looked at, evenly all round; an optimisation goes on uphill from the best of them."""
    mode: Annotated[str, Field(max_length=100)] | None = None
    """Working mode; each machine's own when not given."""


@dataclass(frozen=True)
class GivenLoad:
    """What the drives bear, beside the machine's weight."""

    __pydantic_config__ = STRICT

    force: tuple[Force, Force, Force] = (0.0, 0.0, 0.0)
    """At the platform centre, in {O}."""
    moment: tuple[Moment, Moment, Moment] = (0.0, 0.0, 0.0)
    """On the platform, in {O}."""
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, 0.0, -9.80665)
    """Acceleration of free fall, in {O}."""


@dataclass(frozen=True)
class GivenSweep:
    """Which designs are worked out."""

    __pydantic_config__ = STRICT

    method: Method = "sobol"
    """How designs are drawn."""
    count: Count | None = None
    """Number of designs, which all methods need but grid: there it follows from the steps of the variables."""
    seed: Seed = 0
    """Of what is random: the same number, the same designs."""
    chunk: Annotated[int, Field(strict=True, ge=1, le=1_000_000)] | None = None
    """Designs that are worked out and written together; chosen by the work they make when not given."""


@dataclass(frozen=True)
class GivenLimit:
    """What a design must keep."""

    __pydantic_config__ = STRICT

    quantity: Text
    """What is limited, written as in `quantities`."""
    at_least: Written | None = None
    """Least value that is allowed; this, `at_most` or both."""
    at_most: Written | None = None
    """Greatest value that is allowed."""


@dataclass(frozen=True)
class GivenAims:
    """What is sought."""

    __pydantic_config__ = STRICT

    maximise: Annotated[list[Text], Field(max_length=8)] = field(default_factory=list)
    """Quantities that are to be great, written as in `quantities`."""
    minimise: Annotated[list[Text], Field(max_length=8)] = field(default_factory=list)
    """Quantities that are to be small; one to seek, great or small, is needed."""
    limits: Annotated[list[GivenLimit], Field(max_length=MOST_QUANTITIES)] = field(default_factory=list)
    """What designs must keep; to reach all check points is among it where none of them is of `reached`."""
    evaluations: Annotated[int, Field(strict=True, ge=10, le=100_000_000)] = 2000
    """Designs that the evolution may look at, of each machine."""
    population: Annotated[int, Field(strict=True, ge=4, le=10_000)] = 64
    """Designs of one generation."""
    seed: Seed = 0
    """Of what is random: the same number, the same front."""


@dataclass(frozen=True)
class GivenSensitivity:
    """How uncertainty is followed."""

    __pydantic_config__ = STRICT

    count: Annotated[int, Field(strict=True, ge=8, le=131_072)] = 1024
    """Base samples, a power of two at best; n variables ask for n + 2 designs of each."""
    seed: Seed = 0
    """Of the sequence that samples are drawn from."""


@dataclass(frozen=True)
class StudyFile:
    """Machines, what varies of them, and what is asked of every design."""

    __pydantic_config__ = STRICT

    machines: Annotated[list[Text], Field(min_length=1, max_length=MOST_MACHINES)]
    """Names of the catalogue, or files beside this one, with settings where wanted: "azulay@link.length=200 mm"."""
    variables: Annotated[list[GivenVariable], Field(min_length=1, max_length=MOST_VARIABLES)]
    """What varies of the machines."""
    guides: Annotated[list[Text], Field(max_length=MOST_MACHINES)] = field(default_factory=list)
    """Machines on whose guides the legs of every one of `machines` stand in turn, instead of their own."""
    quantities: Annotated[list[Text], Field(max_length=MOST_QUANTITIES)] = field(default_factory=list)
    """What a sweep and a sensitivity study ask of every design: "mean K_xx", "least clearance", "mass"."""
    poses: GivenPoses = GivenPoses()
    load: GivenLoad = GivenLoad()
    sweep: GivenSweep = GivenSweep()
    optimise: GivenAims = field(default_factory=GivenAims)
    sensitivity: GivenSensitivity = GivenSensitivity()
    format: Literal[1] = 1
    """Version of the file format."""


NEEDED = {
    "machines": 'name one or more, as in machines = ["azulay"]',
    "variables": "say what varies, as in [[variables]] with of, low and high",
}


def read_study_file(path: str | os.PathLike[str]) -> StudyFile:
    """Read a study file.

    Raises:
        InputError: with the file, the key, the value and what was expected.
    """
    return read_checked(path, StudyFile, "a study file", NEEDED)

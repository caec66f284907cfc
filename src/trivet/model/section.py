"""Materials and beam sections."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import equinox as eqx
from pydantic import ConfigDict

from trivet.model.quantity import Area, Density, Expansion, LengthOrZero, PositiveLength, Pressure, Ratio, SecondMoment
from trivet.space.scalar import Scalar

STRICT = ConfigDict(extra="forbid", use_attribute_docstrings=True)


class Material(eqx.Module):
    """An isotropic linear elastic material."""

    __pydantic_config__ = STRICT

    youngs_modulus: Pressure
    """Young's modulus E."""
    poisson_ratio: Ratio
    """Poisson's ratio nu."""
    density: Density
    """Mass density."""
    loss_factor: Ratio | None = None
    """Structural damping eta of Young's and shear modulus, E (1 + i eta); that of the analysis when not given."""
    expansion: Expansion | None = None
    """Linear thermal expansion, growth per length and kelvin; needed by what asks how a warm machine grows."""

    @property
    def shear_modulus(self) -> Scalar:
        """G = E / (2 (1 + nu)), Pa."""
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio))


class SectionProperties(NamedTuple):
    """What a beam needs of its section: areas (m^2) and moments (m^4) about its local y and z axes and about its own axis."""

    area: Scalar
    inertia_y: Scalar
    inertia_z: Scalar
    torsion: Scalar
    shear_area_y: Scalar
    shear_area_z: Scalar


class Outline(NamedTuple):
    """What a section looks like: size (m) along the beam's local y and z axes; round or rectangular; diameter of its bore."""

    width: Scalar
    height: Scalar
    is_round: bool
    bore: Scalar = 0


class Tube(eqx.Module):
    """A round tube."""

    __pydantic_config__ = STRICT

    shape: Literal["tube"] = eqx.field(static=True)
    outer_diameter: PositiveLength
    inner_diameter: LengthOrZero

    def properties(self, poisson_ratio: Scalar) -> SectionProperties:
        """Section properties; shear coefficient of Cowper (1966) for the hollow circle."""
        return _round(self.outer_diameter, self.inner_diameter, poisson_ratio)

    @property
    def outline(self) -> Outline:
        """Both circles."""
        return Outline(self.outer_diameter, self.outer_diameter, True, self.inner_diameter)


class Rod(eqx.Module):
    """A round solid rod."""

    __pydantic_config__ = STRICT

    shape: Literal["rod"] = eqx.field(static=True)
    diameter: PositiveLength

    def properties(self, poisson_ratio: Scalar) -> SectionProperties:
        """Section properties; shear coefficient of Cowper (1966) for the circle."""
        return _round(self.diameter, 0, poisson_ratio)

    @property
    def outline(self) -> Outline:
        """The circle."""
        return Outline(self.diameter, self.diameter, True)


class Rectangle(eqx.Module):
    """A solid rectangle; width along the beam's local y axis, height along its local z axis."""

    __pydantic_config__ = STRICT

    shape: Literal["rectangle"] = eqx.field(static=True)
    width: PositiveLength
    height: PositiveLength

    def properties(self, poisson_ratio: Scalar) -> SectionProperties:
        """Section properties; torsion by Saint-Venant's series, shear coefficient of Cowper (1966)."""
        b, h = self.width, self.height
        shear = 10 * (1 + poisson_ratio) / (12 + 11 * poisson_ratio) * b * h
        return SectionProperties(b * h, b * h**3 / 12, h * b**3 / 12, _rectangle_torsion(b, h), shear, shear)

    @property
    def outline(self) -> Outline:
        """The rectangle."""
        return Outline(self.width, self.height, False)


class General(eqx.Module):
    """A section by its numbers."""

    __pydantic_config__ = STRICT

    shape: Literal["general"] = eqx.field(static=True)
    area: Area
    inertia_y: SecondMoment
    """Second moment of area about the local y axis (bending in the local x-z plane)."""
    inertia_z: SecondMoment
    """Second moment of area about the local z axis (bending in the local x-y plane)."""
    torsion: SecondMoment
    """Torsion constant J."""
    shear_area_y: Area | None = None
    """Area that carries shear along y; needed with Timoshenko beams."""
    shear_area_z: Area | None = None
    """Area that carries shear along z; needed with Timoshenko beams."""

    def properties(self, poisson_ratio: Scalar) -> SectionProperties:
        """Section properties as given; a shear area that is not given is infinite (no shear deflection)."""
        y = math.inf if self.shear_area_y is None else self.shear_area_y
        z = math.inf if self.shear_area_z is None else self.shear_area_z
        return SectionProperties(self.area, self.inertia_y, self.inertia_z, self.torsion, y, z)

    @property
    def outline(self) -> Outline:
        """A square of the same area, since the shape is not given."""
        return Outline(self.area**0.5, self.area**0.5, False)


Section = Tube | Rod | Rectangle | General


def _round(outer: Scalar, inner: Scalar, nu: Scalar) -> SectionProperties:
    area = math.pi / 4 * (outer * outer - inner * inner)
    inertia = math.pi / 64 * (outer**4 - inner**4)
    m2 = (inner / outer) ** 2
    kappa = 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)
    return SectionProperties(area, inertia, inertia, 2 * inertia, kappa * area, kappa * area)


def _rectangle_torsion(b: Scalar, h: Scalar) -> Scalar:
    """Torsion constant of a rectangle (Timoshenko and Goodier, Theory of Elasticity, art. 109), five terms: error < 1e-6."""
    import jax.numpy as jnp

    long, short = jnp.maximum(b, h), jnp.minimum(b, h)
    series = sum(jnp.tanh(n * math.pi * long / (2 * short)) / n**5 for n in (1, 3, 5, 7, 9))
    return long * short**3 / 3 * (1 - 192 / math.pi**5 * short / long * series)

"""Modes of measured responses: poles, with intervals, and shapes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from trivet.errors import InputError, NoResultError
from trivet.measure.checking import check_functions
from trivet.measure.functions import Channel, Functions
from trivet.measure.modal.least_squares_complex import estimate
from trivet.measure.modal.maximum_likelihood import covariance, directions, information
from trivet.measure.modal.model import ModalFit, deviations
from trivet.measure.modal.refinement import most_likely
from trivet.measure.modal.residues import Band, Modes
from trivet.measure.modal.stabilisation import Chosen, Stabilisation, automatic, nearest, stabilisation

POLES = 80
"""In the highest model, unless an order is given: those of all references together."""
ORDERS = (2, 200)
FEWEST_LINES = 16
MARGIN = 0.05
"""Part of the band beyond its ends where poles are looked for: such tell what reaches into it."""
NEAR = 0.03
"""Relative distance from a frequency that was asked for within which a stable pole must lie."""


def fit_modes(
    functions: Functions,
    low: float | None = None,
    high: float | None = None,
    *,
    order: int | None = None,
    poles: Sequence[float] | None = None,
    tell: Callable[[str], None] = lambda doing: None,
) -> ModalFit:
    """Fit a modal model to measured responses over a band.

    Poles and participation vectors of all orders come from the poly-reference least-squares complex frequency estimator; those
    that are stable are refined with shapes, residuals and the noise of every function to greatest likelihood.

    Args:
        functions: responses, at any of displacement, velocity, acceleration; not every response needs every reference.
        low: lower end of the band, Hz; the lowest frequency by default.
        high: upper end.
        order: highest order of the models, each reference bringing as many poles; about 80 poles in all by default.
        poles: frequencies (Hz) of the modes, each for one; chosen by the program by default.
        tell: called with what is being done.

    Raises:
        InputError: for a band without measured lines, an order that they do not bear, no response that has every reference.
        NoResultError: when no pole is stable, or none is where one was asked for.
    """
    check_functions(functions, "measured functions")
    chosen = functions.between(
        functions.frequency[0] if low is None else low, functions.frequency[-1] if high is None else high
    )
    chosen = chosen.between(math.ulp(0.0), math.inf)
    band, responses, references = matrix_of(chosen)
    tell("poles of all orders")
    diagram = _diagram(band, responses, references, _order(order, band))
    picked = _picked(diagram, poles)
    tell("refining")
    band = band.heard()
    found = most_likely(band, Modes.of(picked.poles, picked.participation), poles is None)
    at = found.at
    shared = covariance(information(band, at, directions(at.modes, at.shapes)))
    freedom = 2 * float(np.sum((1 - found.leverage)[band.known]))
    fit = ModalFit(
        chosen, band, responses, references, at.modes, at.shapes, deviations(at.modes, shared, freedom), found.noise, diagram,
        poles is None,
    )  # fmt: skip
    if not len(fit):
        raise NoResultError("no mode of the band stands out of the noise; choose another band, or name --poles")
    return fit


def matrix_of(functions: Functions) -> tuple[Band, tuple[Channel, ...], tuple[Channel, ...]]:
    """Functions as a matrix of receptances, those that are missing marked.

    Raises:
        InputError: with fewer lines than a fit takes.
    """
    lines = len(functions.frequency)
    if lines < FEWEST_LINES:
        raise InputError(f"{lines} frequencies lie in the band; expected {FEWEST_LINES} or more: give a wider one")
    whole, responses, references = functions.matrix()
    derivatives = np.zeros(whole.shape[:2], dtype=int)
    for order, response, reference in zip(functions.orders, functions.responses, functions.references, strict=True):
        derivatives[responses.index(response), references.index(reference)] = order
    known = ~np.isnan(whole).any(axis=-1)
    values = np.where(known[:, :, None], whole, 0) / (1j * functions.omega) ** derivatives[:, :, None]
    return Band(functions.omega, values, known, derivatives), responses, references


def _order(order: int | None, band: Band) -> int:
    references, lines = band.values.shape[1:]
    most = min(ORDERS[1], lines // 3)
    if order is None:
        return min(max(12, math.ceil(POLES / references)), most)
    if order != int(order) or not ORDERS[0] <= order <= most:
        raise InputError(f"--order {order}: expected {ORDERS[0]} to {most}, which {lines} frequencies bear")
    return order


def _diagram(band: Band, responses: Sequence[Channel], references: Sequence[Channel], order: int) -> Stabilisation:
    """Of the responses that have every reference; as mobilities, whose resonances are about equally high."""
    complete = band.known.all(axis=1)
    if not complete.any():
        o, i = (int(k[0]) for k in np.nonzero(~band.known))
        raise InputError(
            f"no response was measured with every reference: {responses[o]} / {references[i]} is missing; "
            "fit one reference alone, or leave out those that few responses have"
        )
    found = estimate(band.omega, band.values[complete] * 1j * band.omega, order)
    margin = MARGIN * (band.omega[-1] - band.omega[0])
    return stabilisation(found, band.omega[0] - margin, band.omega[-1] + margin)


def _picked(diagram: Stabilisation, poles: Sequence[float] | None) -> Chosen:
    if poles is None:
        found = automatic(diagram)
        if not len(found.poles):
            raise NoResultError("no pole is stable; try a higher --order or another band, or name --poles")
        return found
    if not len(poles) or not all(0 < frequency < math.inf for frequency in poles):
        raise InputError(f"--poles: {list(poles)}; expected frequencies above zero")
    found = nearest(diagram, poles)
    wanted, size = np.sort(poles), np.abs(found.poles) / (2 * math.pi)
    for frequency, got in zip(wanted, size if len(size) else np.full(len(wanted), math.nan), strict=True):
        if not abs(got - frequency) <= NEAR * frequency:
            raise NoResultError(
                f"--poles: no stable pole of its own is near {frequency:.6g} Hz; look at the stabilisation diagram (--figure)"
            )
    return found

"""The command measure fit: tables, JSON, NetCDF, figures, wrong input."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from synthetic_modes import Truth, functions, noisy

from trivet.measure.files.by_suffix import save_functions
from trivet.measure.modal.fitting import fit_modes
from trivet.measure.modal.model import ModalFit
from trivet.show.modal_fit import kinds, shown, total

TRUTH = Truth.of((100, 100, 180, 250), (0.01, 0.01, 0.02, 0.01), 4, seed=2)
LINES = np.arange(60.0, 300.0)
Run = Callable[..., tuple[int, str, str]]


@cache
def measured() -> Any:
    return functions(LINES, noisy(TRUTH.matrix(LINES, 2, 2), "relative", 0.02, 1), 2)


@cache
def fitted() -> ModalFit:
    return fit_modes(measured(), 70, 280, order=10)


@pytest.fixture
def fit(trivet: Run, tmp_path: Path) -> Run:
    save_functions(measured(), tmp_path / "measured.nc")
    return lambda *more: trivet("measure", "fit", "measured.nc", "--from", "70 Hz", "--to", "0.28 kHz", "--order", "10", *more)


def test_tables(fit: Run) -> None:
    code, out, _ = fit()
    found = fitted()
    assert code == 0
    assert "synthetic: 4 responses, 2 references, 211 frequencies from 70 to 280 Hz" in out
    above, below = out.split("shapes: where modes move most")
    rows = [line.split() for line in above.splitlines() if line.split() and line.split()[0] in ("1*", "2*", "3", "4")]
    assert [row[0] for row in rows] == ["1*", "2*", "3", "4"]
    for k, row in enumerate(rows):
        frequency, interval, damping, spread, phase = (float(cell) for cell in row[1:6])
        assert frequency == pytest.approx(found.frequency[k], abs=0.1 * found.frequency_interval[k])
        assert interval == pytest.approx(found.frequency_interval[k], rel=0.05)
        assert damping == pytest.approx(100 * found.damping[k], abs=10 * found.damping_interval[k])
        assert spread == pytest.approx(100 * found.damping_interval[k], rel=0.05)
        assert phase == pytest.approx(found.collinearity[k], abs=5e-4)
        assert int(row[6]) == round(100 * found.presence[k])
        assert sum(float(cell) ** 2 for cell in row[7:]) == pytest.approx(1, abs=2e-3)
    assert "* 1 and 2 are one pole 2 times, as far as can be told" in out
    worst = np.unravel_index(np.argmin(found.frac), found.frac.shape)
    first = out.split("the least alike first")[1].splitlines()[2].split()
    assert first[:3] == [str(found.responses[worst[0]]), "/", str(found.references[worst[1]])]
    assert first[3] == f"{found.frac.min():.4f}"

    shape = found.shapes[:, 2].real
    o, p = np.argsort(-np.abs(shape))[:2]
    line = next(line for line in below.splitlines() if line.split()[:1] == ["3"])
    assert f"{found.responses[o]} 1.00, {found.responses[p]} {shape[p]:.2f}, " in line


def test_noise_and_wrong_signs_are_told(trivet: Run, tmp_path: Path) -> None:
    clean = TRUTH.matrix(LINES, 2, 2)
    clean[3] *= 1e-3  # as good as nought
    values = noisy(clean, "relative", 0.02, 1)
    values[3] += 0.01 * np.abs(clean[2]).max() * np.exp(2j * np.pi * np.random.default_rng(4).uniform(size=(2, len(LINES))))
    save_functions(functions(LINES, -values, 2), tmp_path / "turned.nc")
    code, out, _ = trivet("measure", "fit", "turned.nc", "--from", "140 Hz", "--to", "280 Hz", "--order", "10")
    assert code == 0
    assert "2 of 8 functions are mostly noise and do not count" in out
    assert float(out.split("synthesised functions: FRAC ")[1].split()[0]) > 0.99
    assert "at driving points modes 1, 2 answer against the load: the sign of a sensor" in out


def test_one_reference_is_warned_of(trivet: Run, tmp_path: Path) -> None:
    save_functions(measured().only([0, 2, 4, 6]), tmp_path / "one.nc")
    code, out, _ = trivet("measure", "fit", "one.nc", "--from", "140 Hz", "--poles", "180 Hz, 250 Hz")
    assert code == 0
    assert "one reference: modes that coincide come out as one" in out
    assert "poles that were asked for" in out


def test_json(fit: Run) -> None:
    out = json.loads(fit("--json")[1])
    found = fitted()
    assert out["band_Hz"] == [70, 280]
    assert out["highest_order"] == 10
    assert [(one["point"], one["direction"]) for one in out["responses"]] == [
        ("1", [1, 0, 0]),
        ("1", [0, 1, 0]),
        ("1", [0, 0, 1]),
        ("2", [1, 0, 0]),
    ]
    for key, values in (("frequency_Hz", found.frequency), ("damping_ratio_interval", found.damping_interval)):
        np.testing.assert_allclose([mode[key] for mode in out["modes"]], values, rtol=1e-6)
    assert [mode["pole_number"] for mode in out["modes"]] == [1, 1, 2, 3]
    scaled = np.array([mode["scaled_shape_per_sqrt_kg"] for mode in out["modes"]]) @ [1, 1j]
    np.testing.assert_allclose(np.abs(scaled[2]), np.abs(TRUTH.shapes[:, 2]), atol=0.05)
    residue = np.array(out["modes"][2]["shape"]) @ [1, 1j]
    seen = np.array(out["modes"][2]["participation_m_rad_per_s_N"]) @ [1, 1j]
    np.testing.assert_allclose(
        np.outer(residue, seen), TRUTH.residues(2)[..., 2], atol=0.05 * np.abs(TRUTH.residues(2)[..., 2]).max()
    )
    assert len(out["functions"]) == 8
    assert out["functions"][0]["motion"] == "acceleration"
    assert out["functions"][3]["response"] == {"point": "1", "direction": [0, 1, 0], "is_rotation": False}
    assert out["functions"][3]["frac"] == pytest.approx(found.frac[1, 1], rel=1e-6)


def test_netcdf(fit: Run, tmp_path: Path) -> None:
    assert fit("--data", "fit.nc")[0] == 0
    found = fitted()
    with xr.open_dataset(tmp_path / "fit.nc", engine="h5netcdf") as data:
        np.testing.assert_allclose(data.natural_frequency, found.frequency, rtol=1e-6)
        np.testing.assert_allclose(data.damping_interval, found.damping_interval, rtol=1e-4)
        np.testing.assert_allclose(data["shape"].values @ [1, 1j], found.shapes, atol=1e-4)
        np.testing.assert_allclose(data.measured.values @ [1, 1j], found.measured, rtol=1e-12)
        assert data.natural_frequency.units == "Hz"
        assert data.natural_frequency_interval.long_name == "half width of the 95 % interval"
        assert data.response.values.tolist() == ["1:+x", "1:+y", "1:+z", "2:+x"]
        whole = (data["shape"].values @ [1, 1j])[:, None, :] * (data.participation.values @ [1, 1j])
        poles = data.pole.values @ [1, 1j]
        omega = 2 * np.pi * data.frequency.values
        parts = [whole @ (1 / (1j * omega - poles[:, None])), whole.conj() @ (1 / (1j * omega - poles.conj()[:, None]))]
        above, below = (data[name].values @ [1, 1j] for name in ("upper_residual", "lower_residual"))
        receptance = sum(parts) + above[..., None] - below[..., None] / omega**2
        np.testing.assert_allclose(-(omega**2) * receptance, data.synthesised.values @ [1, 1j], rtol=1e-6)


def test_figures(fit: Run, tmp_path: Path) -> None:
    assert fit("--figure", "fit.png", "--figure", "fit.html")[0] == 0
    assert (tmp_path / "fit.png").read_bytes()[:4] == b"\x89PNG"
    page = (tmp_path / "fit.html").read_text()
    assert "sum of magnitudes" in page
    assert "stable in damping and participation too" in page
    found = fitted()
    drawn = shown(found)
    assert [one.name for one in drawn[:2]] == ["1:+x / 1:+x", "1:+y / 1:+y"]
    assert drawn[2].frac == pytest.approx(np.sort(found.frac.ravel()[[1, 2, 4, 5, 6, 7]])[0])
    assert drawn[0].unit == "m/s^2/N"
    assert sum(which.sum() for _, which, *_ in kinds(found)) == len(found.diagram.order)
    size = np.abs(found.measured)
    assert total(found)[7] == pytest.approx(np.sum(size[..., 7] / np.sqrt(np.mean(size**2, axis=-1))))


@pytest.mark.parametrize(
    ("options", "message", "code"),
    [
        (["--poles", "100"], '--poles "100"', 2),
        (["--poles", "100 Hz,,180 Hz"], "--poles", 2),
        (["--from", "275 Hz"], "frequencies lie in the band; expected 16 or more", 2),
        (["--to", "70 Hz", "--from", "280 Hz"], "frequencies from 280 Hz to 70 Hz: the range ends before it begins", 2),
        (["--order", "90"], "--order 90: expected 2 to 70", 2),
        (["--poles", "140 Hz"], "no stable pole of its own is near 140 Hz", 1),
        (["--data", "fit.csv"], "a NetCDF file ends in .nc", 2),
    ],
)
def test_wrong_input(fit: Run, options: list[str], message: str, code: int) -> None:
    found, _, err = fit(*options)
    assert found == code
    assert message in err
    assert len(err.strip().splitlines()) == 1

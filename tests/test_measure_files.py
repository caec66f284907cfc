"""Files of measured responses: what is written comes back, what others write is read, what is wrong is told with its place."""

from __future__ import annotations

import dataclasses
import gzip
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from documents import message_of
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from trivet.errors import InputError
from trivet.measure import checking
from trivet.measure.channels import channel_of, factor_of, unit_of, written
from trivet.measure.files.by_suffix import read_functions, save_functions
from trivet.measure.files.several import import_files
from trivet.measure.functions import MOTIONS, Channel, Functions
from trivet.measure.modal.fitted import read_fitted

SUFFIXES = (".nc", ".csv")
Z, X, RX = (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)
TABLE = """# trivet measured responses
# source: hammer test of the first prototype
# point 12: 100 mm, 0 mm, 2 cm
# frequency: Hz
response,12:+z,12:+z,12:+x,12:+x,12:+x
reference,3:-x,3:-x,3:-x,3:-x,3:-x
motion,acceleration,acceleration,displacement,displacement,displacement
unit,m/s^2/N,m/s^2/N,um/N,deg,1
part,real,imag,amplitude,phase,coherence
10,0.0123,-0.0004,1.25,-90,0.99
12.5,0.5,0.25,2,180,
"""


def some(count: int = 3, lines: int = 5) -> Functions:
    rng = np.random.default_rng(9)
    values = rng.normal(size=(count, lines)) + 1j * rng.normal(size=(count, lines))
    coherence = rng.uniform(size=(count, lines))
    coherence[0], coherence[-1, 2] = math.nan, math.nan
    channels = [Channel("12", Z), Channel("a b:c", RX, True), Channel("7", (0.6, 0.0, 0.8))] * count
    return Functions(
        np.linspace(0, 1000 / 3, lines), values * 1e-7, (MOTIONS * count)[:count], tuple(channels[:count]),
        (Channel("3", X),) * count, {"12": (0.1, 1e-31, -2 / 3), "3": (0.0, 0.0, 0.0)}, coherence, "day 1,\n'second' try,",
    )  # fmt: skip


def same(one: Functions, other: Functions) -> bool:
    """To the last digit."""
    arrays = ("frequency", "values", "coherence")
    words = all(getattr(one, f.name) == getattr(other, f.name) for f in dataclasses.fields(one) if f.name not in arrays)
    pairs = [(np.asarray(getattr(one, a), complex), np.asarray(getattr(other, a), complex)) for a in arrays]
    return words and all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


NUMBERS = st.floats(-1e9, 1e9)
UNIT = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).filter(lambda d: math.hypot(*d) > 0.1)
NAMES = st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=8)
CHANNELS = st.builds(
    Channel,
    NAMES,
    st.one_of(st.sampled_from([Z, X, RX]), UNIT.map(lambda d: tuple(c / math.hypot(*d) for c in d))),
    st.booleans(),
)


@st.composite
def functions(draw: Any) -> Functions:
    count, lines = draw(st.integers(1, 3)), draw(st.integers(1, 4))
    several = st.lists(CHANNELS, min_size=count, max_size=count).map(tuple)
    parts = draw(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=count * lines, max_size=count * lines))
    ones = st.one_of(st.floats(0, 1), st.just(math.nan))
    coherence = np.array(draw(st.lists(ones, min_size=count * lines, max_size=count * lines))).reshape(count, lines)
    return Functions(
        np.array(sorted(draw(st.sets(st.floats(0, 1e5), min_size=lines, max_size=lines)))),
        np.array([complex(*part) for part in parts]).reshape(count, lines),
        draw(st.lists(st.sampled_from(MOTIONS), min_size=count, max_size=count).map(tuple)),
        draw(several),
        draw(several),
        draw(st.dictionaries(NAMES, st.tuples(*[st.floats(-1e3, 1e3)] * 3), max_size=3)),
        None if np.isnan(coherence).all() else coherence,
        draw(st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20)),
    )


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(written_=functions())
def test_what_is_written_comes_back(written_: Functions, suffix: str, tmp_path: Path) -> None:
    assume(len(written_.alike) == len(written_))
    save_functions(written_, tmp_path / f"f{suffix}", overwrite=True)
    assert same(read_functions(tmp_path / f"f{suffix}"), written_)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_files_appear_whole_and_unasked_none_is_replaced(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"f{suffix}"
    save_functions(some(), path)
    before = path.read_bytes()
    assert same(read_functions(path), some())
    assert "exists already" in message_of(lambda: save_functions(some(2), path))
    assert path.read_bytes() == before
    save_functions(some(2), path, overwrite=True)
    assert same(read_functions(path), some(2))
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_netcdf_file_is_labelled(tmp_path: Path) -> None:
    save_functions(some(), tmp_path / "f.nc")
    with xr.open_dataset(tmp_path / "f.nc", engine="h5netcdf") as data:
        assert data.value.dims == ("function", "frequency", "part")
        assert data.frequency.attrs["units"] == "Hz"
        assert data.unit.values.tolist() == ["m/N", "rad/s/N", "m/s^2/N"]
        assert data.response.values.tolist() == ["12:+z", "a b:c:+rx", "7:(0.6, 0.0, 0.8)"]
        assert data.position.attrs["units"] == "m"
        np.testing.assert_array_equal(data.value.sel(part="imag"), some().values.imag)
        np.testing.assert_array_equal(data.position.sel(point="12"), some().points["12"])


def test_a_table_that_people_write(tmp_path: Path) -> None:
    """Units are turned into SI, and programs for tables may pad rows and quote lines of the header."""
    wide = TABLE.replace("# frequency: Hz", "# frequency: kHz,,,,,").replace("\n", "\r\n")
    wide = "\ufeff" + wide.replace("# point 12: 100 mm, 0 mm, 2 cm", '"# point 12: 100 mm, 0 mm, 2 cm",,,,,')
    for text, factor in ((TABLE, 1), (wide, 1000)):
        (tmp_path / "f.csv").write_text(text, encoding="utf-8", newline="")
        found = read_functions(tmp_path / "f.csv")
        assert found.frequency.tolist() == [10 * factor, 12.5 * factor]
        np.testing.assert_allclose(found.values, [[0.0123 - 0.0004j, 0.5 + 0.25j], [-1.25e-6j, -2e-6]], rtol=1e-15, atol=1e-21)
        assert found.labels == ["12:+z / 3:-x", "12:+x / 3:-x"]
        assert found.motions == ("acceleration", "displacement")
        assert found.points == {"12": (0.1, 0.0, 0.02)}
        assert found.source == "hammer test of the first prototype"
        assert found.coherence is not None
        np.testing.assert_array_equal(found.coherence, [[math.nan] * 2, [0.99, math.nan]])


def test_units_and_channels() -> None:
    along, about = Channel("1", Z), Channel("1", Z, True)
    assert unit_of("acceleration", along, along) == "m/s^2/N"
    assert unit_of("velocity", about, about) == "rad/s/(N m)"
    assert factor_of("gravity/N", "acceleration", along, along) == pytest.approx(9.80665)
    assert factor_of("g/kN", "acceleration", along, along) == pytest.approx(9.80665e-3)
    assert factor_of("deg/kN/m", "displacement", about, about) == pytest.approx(math.radians(1) / 1000)
    assert factor_of("rad/(N m)", "displacement", about, about) == 1
    assert factor_of("mm/N", "displacement", along, along) == 1e-3
    assert channel_of(" 3:-rx ") == Channel("3", (-1.0, 0.0, 0.0), True)
    assert channel_of("leg:1:r(0.6, -0, .8)") == Channel("leg:1", (0.6, 0.0, 0.8), True)
    assert channel_of("3:(0.6001, 0, 0.8)").direction == pytest.approx((0.60006399, 0, 0.7999520), abs=1e-7)
    assert written(Channel("3", (0.0, 1 - 1e-12, 0.0))) == f"3:(0.0, {1 - 1e-12!r}, 0.0)"


UNITS = [
    ("g/N", "velocity", Z, False, "is no unit of velocity per load"),
    ("kg/N", "acceleration", Z, False, "is no unit of acceleration per load"),
    ("m/s^2", "acceleration", Z, False, "is no unit of acceleration per load; expected one such as m/s^2/N"),
    ("m/s/N", "acceleration", Z, False, "acceleration per load"),
    ("", "acceleration", Z, False, "acceleration per load"),
    ("dB", "acceleration", Z, False, "acceleration per load"),
    ("m/s^2/lbf/N", "acceleration", Z, False, "acceleration per load"),
    ("mm/N/m", "displacement", Z, True, "expected one such as rad/N"),
    ("rad m/N", "displacement", Z, False, "expected one such as m/N"),
    ("__import__('os')", "displacement", Z, False, "is no unit"),
]


@pytest.mark.parametrize(("unit", "motion", "way", "turns", "message"), UNITS)
def test_wrong_units_are_refused(unit: str, motion: Any, way: Any, turns: bool, message: str) -> None:
    assert message in message_of(lambda: factor_of(unit, motion, Channel("1", way, turns), Channel("2", way)))


@pytest.mark.parametrize("text", ["12", "12:", ":+z", "12:z", "12:+w", "12:+zz", "12:(1, 0)", "12:(1, 0, x)", "12:(nan, 0, 1)",
                                  "12:(1, 1, 0)", "12:(1e400, 0, 0)", "a\nb:+z", "x" * 200 + ":+z"])  # fmt: skip
def test_wrong_channels_are_refused(text: str) -> None:
    assert "channel" in message_of(lambda: channel_of(text))


def changed(old: str, new: str) -> str:
    assert old in TABLE
    return TABLE.replace(old, new, 1)


WRONG: list[tuple[str, str]] = [
    ("", "line 1: expected the first line to be # trivet measured responses, then # frequency: Hz, and rows response,12:+z,…"),
    ("f,H\n1,2\n", "motion,… unit,… part,real,… above the numbers; docs/measure.md has an example"),
    (changed("# trivet", "# other"), "line 1: expected the first line"),
    (changed("# frequency: Hz\n", ""), "line 9: expected a line # frequency: Hz"),
    (changed("# frequency: Hz", "# frequency: rad/s"), 'line 4: unit "rad/s" of frequency: \'rad/s\' is not a unit'),
    (changed("# frequency: Hz", "# frequency:"), "the unit is missing"),
    (changed("# frequency", "# frequenzy"), "did you mean 'frequency'"),
    (changed("# source: hammer test of the first prototype", "# frequency: Hz"), "line 4: # frequency: is given twice"),
    (changed("100 mm, 0 mm", "100 mm, 0"), 'line 3: unit "" of position: the unit is missing'),
    (changed("100 mm, 0 mm", "100 mm 0 mm"), "line 3: "),
    (changed("100 mm", "1_0 mm"), 'line 3: "1_0": expected a finite number'),
    (changed("# source: hammer test of the first prototype", "# point 12: 0 m, 0 m, 0 m"), "# point 12: is given twice"),
    (changed("unit,m/s^2/N,m/s^2/N,um/N,deg,1\n", ""), "line 9: expected a row unit,… above the numbers"),
    (changed("unit,m/s^2/N", "unit,kg/N"), 'line 8, column 2: unit "kg/N": is no unit of acceleration per load'),
    (changed("unit,m/s^2/N", "unit,"), 'column 2: unit "": is no unit'),
    (changed("um/N,deg", "um/N,mm"), "line 8, column 5: unit \"mm\" of phase: 'mm' is not a unit of angle"),
    (changed("deg,1", "deg,%"), 'column 6: unit "%" of coherence: expected 1'),
    (changed("motion,acceleration", "motion,accelleration"), "column 2: \"accelleration\": expected one of"),
    (changed("part,real,imag", "part,imag,real"), "line 9, column 2: expected real and imag, or amplitude and phase"),
    (changed("12:+z,12:+z", "12:+z,12:+y"), "column 2: expected real and imag, or amplitude and phase, of one function"),
    (changed("deg,1", "1,1").replace("phase,coherence", "coherence,coherence"), "line 9, column 4: expected real"),
    (changed("3:-x,3:-x", "3,3:-x"), 'line 6, column 2: channel "3": expected a point and a direction'),
    (changed("reference,3:-x", "reference"), "line 6: reference: has 4 columns; the row response has 5"),
    (changed("reference", "response"), "line 6: response: there is such a row already"),
    (changed("reference", "referenz"), "line 6: \"referenz\": expected a row of response"),
    (changed("12.5,0.5", "12.5,nan"), 'line 11, column 2: "nan": expected a finite number'),
    (changed("12.5,0.5", "12.5,inf"), 'line 11, column 2: "inf"'),
    (changed("12.5,0.5", "12.5,0_5"), 'line 11, column 2: "0_5"'),
    (changed("12.5,0.5", "12.5,"), 'line 11, column 2: ""'),
    (changed("12.5,0.5", "12,5,0.5"), "line 11: has 7 cells; expected 6: the frequency and 5 columns"),
    (changed("12.5,0.5", "10,0.5"), "line 11, column 1: frequency 10 after 10: expected frequencies that rise"),
    (changed("10,0.0123", "-10,0.0123"), "line 10, column 1: frequency -10: expected"),
    (changed("0.25,2,180", "0.25,-2,180"), 'line 11, column 4: "-2": expected an amplitude'),
    (changed("-90,0.99", "-90,1.5"), "coherence of 12:+x / 3:-x at 10 Hz: 1.5; expected 0 to 1"),
    (TABLE.replace("# point 12: 100 mm, 0 mm, 2 cm\n", "").replace(",", ";"), "is the table separated by commas?"),
    (TABLE[: TABLE.index("10,0.0123")], "line 9: expected rows of numbers; there are none"),
    (TABLE[:-12], "line 11: has"),
    (TABLE + '13,"0.5', "line 12: is no row of comma-separated values"),
    (changed("10,0.0123", f"10,{'1' * 200_000}"), "field larger than field limit"),
    (changed("10,0.0123", f"10{',' * 4_000_000}"), "line 10: is longer than 3000000 letters"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), WRONG, ids=[str(k) for k in range(len(WRONG))])
def test_wrong_tables_are_told_with_line_and_column(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_text(text, encoding="utf-8")
    told = message_of(lambda: read_functions(tmp_path / "f.csv"))
    assert message in told
    assert told.startswith(str(tmp_path / "f.csv"))


def test_a_table_in_another_encoding(tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_bytes(TABLE.replace("first", "größt").encode("latin-1"))
    assert "is no text in UTF-8" in message_of(lambda: read_functions(tmp_path / "f.csv"))


Change = Callable[[Any], None]


def replaced(name: str, data: Any, **settings: Any) -> Change:
    """A change of a NetCDF file: one variable is another one."""

    def change(file: Any) -> None:
        units = file[name].attrs.get("units") if name in file else None
        del file[name]
        file.create_dataset(name, data=data, **settings)
        if units is not None:
            file[name].attrs["units"] = units

    return change


def huge(name: str, shape: tuple[int, ...]) -> Change:
    """A few bytes of file that claim to be a great array."""

    def change(file: Any) -> None:
        del file[name]
        file.create_dataset(name, shape, "f8", chunks=tuple(min(n, 1000) for n in shape), compression="gzip")
        file[name].attrs["units"] = "Hz"

    return change


def outside(file: Any) -> None:
    file.create_dataset("new", (3, 5), "f8", external=[("secret", 0, 120)])
    del file["coherence"]
    file.move("new", "coherence")


def attribute(name: str, key: str, value: Any) -> Change:
    def change(file: Any) -> None:
        (file[name] if name else file).attrs[key] = value

    return change


def linked(file: Any) -> None:
    del file["value"]
    file["value"] = h5py.ExternalLink("other.nc", "value")


def value_of(value: float) -> Change:
    def change(file: Any) -> None:
        file["value"][1, 2] = [value, 0.0]

    return change


def labels(name: str, words: list[str]) -> Change:
    def change(file: Any) -> None:
        file[name][...] = words

    return change


def renamed(name: str, other: str) -> Change:
    return lambda file: file.move(name, other)


WORDS = h5py.string_dtype()
HOSTILE: list[tuple[Change, str]] = [
    (lambda file: file.__delitem__("value"), "value: is missing; a file of measured responses has frequency, value"),
    (lambda file: file.__delitem__("unit"), "unit: is missing"),
    (huge("value", (3, 5, 2_000_000_000)), "value: has shape (3, 5, 2000000000); expected (3, 5, 2)"),
    (huge("frequency", (2_000_000_000,)), "frequency: has 2000000000 numbers; expected at most"),
    (huge("coherence", (10**6, 10**6)), "coherence: has shape"),
    (replaced("value", np.zeros((3, 5, 2), "c16")), "value: holds complex128; expected numbers"),
    (replaced("value", np.zeros((3, 10))), "value: has shape (3, 10); expected (3, 5, 2)"),
    (replaced("value", np.array([[["x"] * 2] * 5] * 3, dtype=object), dtype=WORDS), "value: holds object; expected numbers"),
    (replaced("response", np.arange(3.0)), "response: holds float64; expected words"),
    (replaced("motion", ["acceleration"] * 2, dtype=WORDS), "motion: has shape (2,)"),
    (replaced("motion", ["acceleration", "jerk", "velocity"], dtype=WORDS), 'motion 2: "jerk"'),
    (replaced("response", ["1:+z", "x" * 5000, "3:+z"], dtype=WORDS), "response 2: "),
    (replaced("response", ["1:+z", b"\xff\xfe", "3:+z"], dtype=WORDS), "is no NetCDF-4 file, or is damaged"),
    (replaced("response", ["1:+z", "2", "3:+z"], dtype=WORDS), 'response 2: channel "2"'),
    (replaced("unit", ["m/N", "m/s/N", "m/s^2/N"], dtype=WORDS), 'unit 2: unit "m/s/N": is no unit of velocity'),
    (replaced("frequency", np.array([1.0, 2, 3, 3, 4])), "frequency 4 of 5: 3 Hz after 3 Hz; expected rising ones"),
    (replaced("frequency", np.array([1.0, 2, math.nan, 3, 4])), "frequency 3 of 5: nan Hz; expected a finite one"),
    (attribute("frequency", "units", "rad/s"), 'frequency: has units "rad/s"; expected Hz'),
    (attribute("frequency", "units", 5), "frequency: units: 5; expected words"),
    (attribute("position", "units", "kg"), "position: has units \"kg\": 'kg' is not a unit of length"),
    (attribute("", "source", np.arange(5)), "source: array([0, 1, 2, 3, 4]); expected words"),
    (replaced("position", np.full((2, 3), 1e9)), "coordinates up to 10000 m"),
    (replaced("point", ["12", "12"], dtype=WORDS), "point: names some points twice"),
    (value_of(math.nan), "a b:c:+rx / 3:-x at 166.667 Hz: nan"),
    (value_of(math.inf), "a b:c:+rx / 3:-x at 166.667 Hz: inf+"),
    (value_of(-2.7e59), "Hz: -2.7e+59+0j; expected a finite value up to 1e+24"),
    (replaced("frequency", 1e30 * np.arange(5.0)), "frequency 2 of 5: 1e+30 Hz; expected a finite one, 0 to 1e+09 Hz"),
    (attribute("value", "scale_factor", "2"), 'value: scale_factor: "2"; expected a number'),
    (labels("part", ["real", "angle"]), "part: is real, angle; expected real, imag"),
    (labels("axis", ["x", "y", "w"]), "axis: is x, y, w; expected x, y, z"),
    (renamed("function", "chan"), "value: has dimensions chan, frequency, part; expected function, frequency, part"),
    (attribute("", "kind", "trivet modal fit"), "holds a modal fit, not measured responses"),
    (lambda file: file.attrs.__delitem__("kind"), "holds other results, not measured responses"),
    (linked, "value: is no array in this file"),
    (outside, "coherence: is no array in this file"),
    (lambda file: (file.__delitem__("value"), file.create_group("value"))[0], "value: is no array in this file"),
]


@pytest.mark.parametrize(("change", "message"), HOSTILE, ids=[str(k) for k in range(len(HOSTILE))])
@pytest.mark.filterwarnings("error")
def test_netcdf_of_others_is_looked_at_before_it_is_read(change: Change, message: str, tmp_path: Path) -> None:
    save_functions(some(), tmp_path / "f.nc")
    with h5py.File(tmp_path / "f.nc", "r+") as file:
        change(file)
    told = message_of(lambda: read_functions(tmp_path / "f.nc"))
    assert message in told
    assert told.startswith(str(tmp_path / "f.nc"))


def test_netcdf_in_other_units_and_precision(tmp_path: Path) -> None:
    save_functions(some(), tmp_path / "f.nc")
    with h5py.File(tmp_path / "f.nc", "r+") as file:
        replaced("value", file["value"][...].astype(">f4"))(file)
        replaced("unit", ["mm/N", "deg/s/N", "gravity/kN"], dtype=WORDS)(file)
        file["position"].attrs["units"] = "mm"
    found = read_functions(tmp_path / "f.nc")
    factors = np.array([1e-3, math.radians(1), 9.80665e-3])[:, None]
    np.testing.assert_allclose(found.values, some().values * factors, rtol=1e-6)
    assert found.points["12"][2] == pytest.approx(-2e-3 / 3)


PACKING = {"value": {"dtype": "i4", "scale_factor": 1e-15, "add_offset": 1e-7, "_FillValue": -1},
           "coherence": {"dtype": "i2", "scale_factor": 1e-4, "_FillValue": -1}}  # fmt: skip
OTHERS: dict[str, Callable[[xr.Dataset, Path], Any]] = {
    "dimensions": lambda data, path: data.transpose("axis", "part", "frequency", "function", "point").to_netcdf(path),
    "parts": lambda data, path: data.isel(part=[1, 0]).to_netcdf(path),
    "axes": lambda data, path: data.isel(axis=[2, 0, 1]).to_netcdf(path),
    "packed": lambda data, path: data.to_netcdf(path, encoding=PACKING),
    "all": lambda data, path: data.isel(part=[1, 0], axis=[1, 0, 2]).transpose(..., "function").to_netcdf(
        path, encoding=PACKING
    ),
}  # fmt: skip


@pytest.mark.parametrize("how", OTHERS)
def test_netcdf_that_others_write_in_their_way(how: str, tmp_path: Path) -> None:
    save_functions(some(), tmp_path / "f.nc")
    with xr.open_dataset(tmp_path / "f.nc", engine="h5netcdf") as data:
        OTHERS[how](data.load(), tmp_path / "g.nc")
    found, known = read_functions(tmp_path / "g.nc"), some()
    exact = {"atol": 1e-15} if how in ("packed", "all") else {"rtol": 0}
    np.testing.assert_allclose(found.values, known.values, **exact)
    np.testing.assert_allclose(found.coherence, known.coherence, atol=1e-4 if "atol" in exact else 0)
    assert (found.points, found.labels) == (known.points, known.labels)


def test_functions_that_were_measured_twice_come_as_their_mean(tmp_path: Path) -> None:
    """As if all blows had been one measurement: by spectra of single blows with loads alike, which H1 averages."""
    rng = np.random.default_rng(2)
    force = np.exp(2j * np.pi * rng.uniform(size=(8, 5)))
    motion = (1 + 2j) * force + 0.4 * (rng.normal(size=(8, 5)) + 1j * rng.normal(size=(8, 5)))

    def estimate(own: slice) -> tuple[np.ndarray, np.ndarray]:
        cross = np.mean(motion[own] * force[own].conj(), axis=0)
        return cross, np.abs(cross) ** 2 / np.mean(np.abs(motion[own]) ** 2, axis=0)

    rows = [estimate(slice(4)), estimate(slice(4, 8)), (np.ones(5), np.full(5, math.nan))]
    values, coherence = (np.array([row[k] for row in rows]) for k in (0, 1))
    ends = (Channel("1", Z), Channel("1", Z), Channel("2", Z))
    whole = Functions(np.arange(1.0, 6), values, ("velocity",) * 3, ends, (Channel("1", Z),) * 3, {}, coherence)
    save_functions(whole, tmp_path / "f.csv")
    save_functions(whole.only([1, 2]), tmp_path / "g.nc")
    found = import_files([tmp_path / "f.csv"])
    wanted = estimate(slice(8))
    np.testing.assert_allclose(found.functions.values, [wanted[0], np.ones(5)], rtol=1e-12)
    np.testing.assert_allclose(found.functions.coherence, [wanted[1], np.full(5, math.nan)], rtol=1e-12)
    assert found.units == ("m/s/N",) * 2
    note = (
        f"1:+z / 1:+z is measured twice, in {tmp_path / 'f.csv'}: function 1 and {tmp_path / 'f.csv'}: function 2: the mean is"
    )
    assert found.notes[0].startswith(note)
    assert found.notes[1:] == ("no coherence is given of function 2:+z / 1:+z", "no position is given of 2 points: 1, 2")
    assert read_functions(tmp_path / "f.csv").labels == ["1:+z / 1:+z", "2:+z / 1:+z"]
    np.testing.assert_allclose(whole.matrix()[0][:, 0], [wanted[0], np.ones(5)], rtol=1e-12)
    other = dataclasses.replace(whole, motions=("velocity", "acceleration", "velocity"))
    assert "1:+z / 1:+z was measured as several motions, acceleration among them" in message_of(other.matrix)
    (tmp_path / "h.nc").symlink_to(tmp_path / "g.nc")
    assert "h.nc: is given twice, as " in message_of(lambda: import_files([tmp_path / "g.nc", tmp_path / "h.nc"]))


def test_units_are_told_as_the_file_has_them(tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_text(TABLE.replace("m/s^2/N", "g/N"))
    assert import_files([tmp_path / "f.csv"]).units == ("g/N", "um/N")
    for least in (math.nan, -0.1, 1.5):
        told = message_of(lambda least=least: import_files([tmp_path / "f.csv"], least_coherence=least))
        assert told == f"--least-coherence {least:g}: expected 0 to 1"
    save_functions(some(), tmp_path / "f.nc")
    with h5py.File(tmp_path / "f.nc", "r+") as file:
        file["unit"][0] = "mm/N"
    assert import_files([tmp_path / "f.nc"]).units == ("mm/N", "rad/s/N", "m/s^2/N")


@pytest.mark.parametrize("suffix", [".csv", ".nc", ".unv"])
@pytest.mark.parametrize(("way", "packed"), [("gzip", gzip.compress(b"x", mtime=0)), ("zip", b"PK\x03\x04..")])
def test_what_is_compressed_is_told(suffix: str, way: str, packed: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"f{suffix}"
    path.write_bytes(packed)
    assert message_of(lambda: read_functions(path)) == f"{path}: is compressed ({way}); unpack it first"


def fitted_file(path: Path, change: Change | None = None) -> Path:
    """As `trivet measure fit` writes it: two modes at three channels."""
    with h5py.File(path, "w") as file:
        file["response"] = np.array(["1:+z", "2:(0.6, 0.0, 0.8)", "2:-ry"], dtype=WORDS)
        file["natural_frequency"], file["damping"] = [100.0, 90.0], [0.01, 0.02]
        file["natural_frequency"].attrs["units"] = "Hz"
        file["shape"] = np.arange(12.0).reshape(3, 2, 2)
        if change is not None:
            change(file)
    return path


def test_modes_of_a_fit(tmp_path: Path) -> None:
    found = read_fitted(fitted_file(tmp_path / "f.nc"))
    assert found.channels == (Channel("1", Z), Channel("2", (0.6, 0.0, 0.8)), Channel("2", (0.0, -1.0, 0.0), True))
    assert found.modes.frequency.tolist() == [100, 90]
    assert found.modes.shapes.tolist() == [[1j, 2 + 3j], [4 + 5j, 6 + 7j], [8 + 9j, 10 + 11j]]


FITS: list[tuple[Change, str]] = [
    (lambda file: file.__delitem__("shape"), "shape: is missing; a file of a modal fit has natural_frequency, damping, shape"),
    (replaced("shape", np.zeros((3, 2))), "shape: has shape (3, 2); expected (3, 2, 2)"),
    (replaced("shape", np.zeros((3, 2, 2))), "mode 1: its shape has a component that is no number, or moves nowhere"),
    (replaced("shape", np.full((3, 2, 2), math.nan)), "mode 1: its shape has a component that is no number"),
    (replaced("damping", [0.01, 1.5]), "mode 2: 90 Hz, damping ratio 1.5; expected above 0 Hz, and below 1"),
    (replaced("natural_frequency", [0.0, 90]), "mode 1: 0 Hz"),
    (replaced("natural_frequency", np.ones(5000)), "has 5000 modes at 3 channels; expected 1 to 1000"),
    (attribute("natural_frequency", "units", "rad/s"), "natural_frequency: expected units Hz"),
    (replaced("response", ["1:+z", "2:+x", "1:+z"], dtype=WORDS), "response: 1:+z is given twice"),
]


@pytest.mark.parametrize(("change", "message"), FITS, ids=[str(k) for k in range(len(FITS))])
def test_fits_that_are_none(change: Change, message: str, tmp_path: Path) -> None:
    assert message in message_of(lambda: read_fitted(fitted_file(tmp_path / "f.nc", change)))


@pytest.mark.parametrize("cut", [0, 10, 3000, -2000])
def test_truncated_netcdf(cut: int, tmp_path: Path) -> None:
    save_functions(some(), tmp_path / "f.nc")
    whole = (tmp_path / "f.nc").read_bytes()
    (tmp_path / "f.nc").write_bytes(whole[:cut])
    assert "is no NetCDF-4 file, or is damaged" in message_of(lambda: read_functions(tmp_path / "f.nc"))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_files_beyond_the_bounds_are_refused_unread(suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / f"f{suffix}"
    with open(path, "wb") as file:
        file.truncate(1_000_000_000)
    assert "has 1000 MB; expected at most 500 MB" in message_of(lambda: read_functions(path))
    path.unlink()
    save_functions(some(), path)
    monkeypatch.setattr(checking, "MOST_VALUES", 14)
    assert "3 functions at 5 frequencies; expected at most" in message_of(lambda: read_functions(path))


def test_names_and_places_that_are_no_files(tmp_path: Path) -> None:
    assert "ends in .nc or .csv" in message_of(lambda: read_functions(tmp_path / "f.xlsx"))
    assert "ends in .nc or .csv" in message_of(lambda: save_functions(some(), tmp_path / "f.txt"))
    assert "cannot be read" in message_of(lambda: read_functions(tmp_path / "f.csv"))
    (tmp_path / "d.csv").mkdir()
    assert "is no regular file" in message_of(lambda: read_functions(tmp_path / "d.csv"))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_responses_that_no_file_holds(suffix: str, tmp_path: Path) -> None:
    broken = some()
    broken.values[1, 2] = math.nan
    for wrong, message in (
        (broken, "a b:c:+rx / 3:-x at 166.667 Hz: nan"),
        (dataclasses.replace(some(), frequency=some().frequency[::-1]), "expected rising ones"),
        (dataclasses.replace(some(), motions=("displacement",) * 2), "do not belong together"),
        (dataclasses.replace(some(), references=(Channel("", Z),) * 3), "expected a named point"),
        (dataclasses.replace(some(), references=(Channel("1", (1.0, 1.0, 0.0)),) * 3), "and a unit vector"),
        (dataclasses.replace(some(), coherence=np.ones((3, 4))), "coherence: has shape (3, 4)"),
    ):
        with pytest.raises(InputError) as caught:
            save_functions(wrong, tmp_path / f"f{suffix}")
        assert message in str(caught.value)
        assert "cannot be written" in str(caught.value)
    assert list(tmp_path.iterdir()) == []

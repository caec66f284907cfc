"""Universal files: every number is read as it stands, units and directions as they are told, and what is wrong is named."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import plain_universal as plain
import pytest
import pyuff
from documents import message_of
from hypothesis import given
from hypothesis import strategies as st

from trivet.measure.files.by_suffix import read_functions, save_functions
from trivet.measure.files.several import import_files
from trivet.measure.functions import Channel, Functions
from trivet.measure.imported import MeasuredMode
from trivet.measure.joining import first_difference
from trivet.measure.universal.axis import even_axis, is_even
from trivet.measure.universal.parse import parse
from trivet.measure.universal.reading import read_universal
from trivet.measure.universal.scan import LARGEST, scan
from trivet.measure.universal.writing import write_universal

N = 23
F = 0.25 * np.arange(4, 4 + N)
Y = np.exp(1j * np.arange(N)) * (1.0 + 1e-3 * np.arange(N))
RNG = np.random.default_rng(20261127)
G = 9.80665
GOOD = plain.function(F, Y)
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def put(folder: Path, *datasets: bytes, name: str = "a.unv") -> Path:
    path = folder / name
    path.write_bytes(b"".join(datasets))
    return path


FORMS = [(ordinate, even) for ordinate in (2, 4, 5, 6) for even in (True, False)]


@pytest.mark.parametrize(("ordinate", "even"), FORMS)
@pytest.mark.parametrize("how", ["text", "<", ">", "<narrow", ">narrow"])
def test_all_forms_of_functions(tmp_path: Path, ordinate: int, even: bool, how: str) -> None:
    """Each number, by a parser of fixed columns that shares nothing with ours, and by what was written."""
    y = Y if ordinate in (5, 6) else Y.real
    settings: dict[str, Any] = {"ordinate": ordinate, "even": even}
    if how == "text":
        data = plain.function(F, y, **settings)
    else:
        data = plain.function_bytes(F, y, how[0], narrow=how.endswith("narrow"), **settings)
    (block,) = scan(put(tmp_path, data))
    found = parse(block)
    assert found is not None
    ours = plain.numbers(found["x"], found["data"], even)
    ((kind, theirs),) = plain.read(data)
    assert (kind, block.kind, block.body is not None) == (58, 58, how != "text")
    np.testing.assert_array_equal(ours, theirs)
    digits = 1e-12 if ordinate in (4, 6) else 1e-7 if how != "text" else 1e-5
    np.testing.assert_allclose(found["data"], y, rtol=digits, atol=digits)
    np.testing.assert_allclose(found["x"], F, rtol=1e-6)


@pytest.mark.parametrize("change", ["crlf", "blanks", "d", "latin", "filled", "feed"])
def test_ways_of_writing_that_mean_the_same(tmp_path: Path, change: str) -> None:
    data = plain.function(F, Y, ordinate=5)
    if change == "crlf":
        data = data.replace(b"\n", b"\r\n")
    if change == "blanks":
        data = b"\n".join(line.ljust(80) for line in data.split(b"\n"))
    if change == "d":
        head, body = data.split(b"\n", 13)[:13], data.split(b"\n", 13)[13]
        data = b"\n".join([*head, body.replace(b"E", b"D")])
    if change == "latin":
        data = data.replace(b"m/s^2 ", "m/s²  ".encode("latin-1"))
    if change == "filled":
        lines = data.split(b"\n")
        lines[-3] += b"  0.00000E+00" * (6 - len(lines[-3]) // 13)
        data = b"\n".join(lines)
    if change == "feed":
        data = data.replace(b"response", b"resp\x0cnse\x85")
    found = read_universal(put(tmp_path, data)).functions
    np.testing.assert_array_equal(found.frequency, F)
    np.testing.assert_allclose(found.values[0], Y, rtol=1e-5, atol=1e-5)


def test_bytes_that_look_like_an_end(tmp_path: Path) -> None:
    """Eight bytes of a number are '    -1' and a line feed; pyuff by itself ends the dataset there."""
    (number,) = np.frombuffer(b"\n    -1\n", dtype="<f8")
    y = np.array([number + 1j * number, number, *Y[2:]])
    path = put(tmp_path, plain.function_bytes(F, y), plain.function(F, Y, response=(3, 1)))
    found = read_universal(path).functions
    np.testing.assert_array_equal(found.values[0], y)
    assert found.labels == ["1:+z / 2:-x", "3:+x / 2:-x"]
    assert len(pyuff.UFF(str(path)).get_set_types()) != 2


def test_numbers_that_pyuff_takes_for_others_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pyuff.datasets import dataset_58

    as_is = dataset_58._extract58

    def other(*arguments: Any, **options: Any) -> dict[str, Any]:
        found = as_is(*arguments, **options)
        return found if options else found | {"data": found["data"] + 1e-9 * (np.arange(N) == 5)}

    monkeypatch.setattr(dataset_58, "_extract58", other)
    path = put(tmp_path, plain.function(F, Y))
    assert "numbers do not stand in the columns of their form, 20 characters wide" in message_of(lambda: read_universal(path))


FREQUENCIES = [
    ("NONE", 1.0), ("(Hz)", 1.0), ("HZ", 1.0), ("kHz", 1e3), ("KHZ", 1e3), ("cps", 1.0), ("CPS", 1.0), ("rad/s", 0.5 / math.pi),
    ("RAD/S", 0.5 / math.pi),
]  # fmt: skip
NO_LABELS = ("NONE", "NONE", "NONE")
UNITS = [
    ({"labels": ("Hz", "m/s^2", "N")}, 1.0),
    ({"labels": ("Hz", "g", "N")}, G),
    ({"labels": ("NONE", "G's", "lbf")}, G / 4.4482216152605),
    ({"labels": ("Hz", "mm/s2", "kN")}, 1e-6),
    ({"labels": ("Hz", "IN/S^2", "LBF")}, 0.0254 / 4.4482216152605),
    ({"labels": ("Hz", "(m/s²)/N", "NONE"), "types": (18, 12, 0)}, 1.0),
    ({"labels": ("Hz", "(1/N)*(m/s²)", "NONE"), "types": (18, 1, 0)}, 1.0),
    ({"labels": ("Hz", "g/N", "NONE"), "types": (18, 0, 0)}, G),
    ({"labels": ("Hz", "um", "N"), "types": (18, 8, 13)}, 1e-6),
    ({"labels": ("Hz", "mm/s", "N"), "types": (18, 11, 9)}, 1e-3),
    ({"labels": ("Hz", "m/s", "N"), "types": (0, 0, 0)}, 1.0),
    ({"labels": ("Hz", "deg/s^2", "N"), "response": (1, 5)}, math.pi / 180),
    ({"labels": ("Hz", "rad/s^2", "N*m"), "response": (1, 5), "reference": (2, 6)}, 1.0),
    ({"exponents": ((1, 0), (0, 1))}, 1.0),
]


@pytest.mark.parametrize(("label", "factor"), FREQUENCIES)
def test_units_of_frequency(tmp_path: Path, label: str, factor: float) -> None:
    found = read_universal(put(tmp_path, plain.function(F, Y, labels=(label, "m/s^2", "N")))).functions
    np.testing.assert_allclose(found.frequency, factor * F, rtol=1e-12)


@pytest.mark.parametrize(("settings", "factor"), UNITS, ids=[str(s) for s, _ in UNITS])
def test_units_by_labels(tmp_path: Path, settings: dict[str, Any], factor: float) -> None:
    found = read_universal(put(tmp_path, plain.function(F, Y, **settings)))
    np.testing.assert_allclose(found.functions.values[0] / Y, factor, rtol=1e-9)
    kind = settings.get("types", (18, 12, 13))[1]
    wanted = {8: "displacement", 11: "velocity", 12: "acceleration", 1: "acceleration"}
    told = wanted.get(kind, "velocity" if settings.get("labels", NO_LABELS)[1] == "m/s" else "acceleration")
    assert found.functions.motions == (told,)


def test_units_by_dataset_164(tmp_path: Path) -> None:
    """Inches and pounds: SI over the file's is 39.37 and 0.2248."""
    system = plain.units(1 / 0.0254, 1 / 4.4482216152605)
    place = plain.points([(1, 0, 0, (10.0, 0.0, -1.0))])
    turned = plain.function(F, Y, labels=NO_LABELS, response=(1, 4), reference=(2, -5))
    found = read_universal(put(tmp_path, system, place, plain.function(F, Y, labels=NO_LABELS), turned)).functions
    np.testing.assert_allclose(found.values[0] / Y, 0.0254 / 4.4482216152605, rtol=1e-12)
    np.testing.assert_allclose(found.values[1] / Y, 1 / (0.0254 * 4.4482216152605), rtol=1e-12)
    np.testing.assert_allclose(found.points["1"], (0.254, 0, -0.0254))
    # A label for one of both, the other as dataset 164 has it.
    half = read_universal(put(tmp_path, plain.units(1000, 1), plain.function(F, Y, labels=("Hz", "mm/s^2", "NONE")))).functions
    np.testing.assert_allclose(half.values[0] / Y, 1e-3, rtol=1e-12)


def test_units_as_declared_go_before_the_file(tmp_path: Path) -> None:
    path = put(tmp_path, plain.units(1000, 1000), plain.points([(1, 0, 0, (1.0, 2.0, 3.0))]), plain.function(F, Y))
    found = read_universal(path, "g per kN, cm")
    np.testing.assert_allclose(found.functions.values[0] / Y, G / 1000, rtol=1e-9)
    np.testing.assert_allclose(found.functions.points["1"], (0.01, 0.02, 0.03))
    assert found.units == ("g per kN",)


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues."""
    k = axis / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


TURNED = rotation(np.array([1.0, 2.0, -0.5]), 0.7)
ORIGIN = np.array([10.0, -5.0, 20.0])
PLACE = np.array([40.0, 25.0, -3.0])


def slope(kind: int, at: np.ndarray, which: int) -> np.ndarray:
    """Direction in which a coordinate grows, by differences: r, theta, z of a cylinder, r, theta, phi of a sphere."""

    def place(c: np.ndarray) -> np.ndarray:
        if kind == 1:
            return np.array([c[0] * math.cos(c[1]), c[0] * math.sin(c[1]), c[2]])
        return c[0] * np.array([math.sin(c[2]) * math.cos(c[1]), math.sin(c[2]) * math.sin(c[1]), math.cos(c[2])])

    radius = math.hypot(at[0], at[1])
    own = (
        np.array([radius, math.atan2(at[1], at[0]), at[2]])
        if kind == 1
        else np.array([np.linalg.norm(at), math.atan2(at[1], at[0]), math.atan2(radius, at[2])])
    )
    np.testing.assert_allclose(place(own), at, atol=1e-12)
    step = 1e-6 * np.eye(3)[which]
    found = place(own + step) - place(own - step)
    return found / np.linalg.norm(found)


@pytest.mark.parametrize("kind", [0, 1, 2])
@pytest.mark.parametrize("code", [1, -2, 3, 5, -6])
def test_directions_in_local_systems(tmp_path: Path, kind: int, code: int) -> None:
    """The columns of dataset 2420 are the axes: as in files of Test.Lab, where those of a wing lie along it."""
    matrix = np.vstack([TURNED, ORIGIN])
    path = put(
        tmp_path,
        plain.units(1000, 1),
        plain.systems([(7, kind, matrix)]),
        plain.points([(1, 7, 7, tuple(PLACE)), (2, 0, 0, (0.0, 0.0, 0.0))]),
        plain.function(F, Y, labels=("Hz", "rad/s^2" if abs(code) > 3 else "m/s^2", "N"), response=(1, code)),
    )  # fmt: skip
    if abs(code) <= 3:
        path.write_bytes(path.read_bytes().replace(b"m/s^2 ", b"mm/s^2"))
    (channel,) = read_universal(path).functions.responses
    which = (abs(code) - 1) % 3
    local = np.eye(3)[which] if kind == 0 else slope(kind, TURNED.T @ (PLACE - ORIGIN), which)
    np.testing.assert_allclose(channel.direction, math.copysign(1, code) * TURNED @ local, atol=1e-8)
    assert channel.is_rotation == (abs(code) > 3)


def test_old_points_glued_and_local(tmp_path: Path) -> None:
    """Dataset 15 with three-digit exponents has no blank between negative numbers; positions are in their own system."""
    row = f"{17:10d}{3:10d}{0:10d}{1:10d}-1.00000E+001-2.00000E+001-3.00000E+001"
    systems = plain.systems([(3, 0, np.vstack([TURNED, ORIGIN]))])
    found = read_universal(
        put(tmp_path, plain.units(1000, 1000), systems, plain.dataset(15, row), plain.function(F, Y)), "m/s^2 per N"
    )
    np.testing.assert_allclose(found.functions.points["17"], 1e-3 * (TURNED @ [-10, -20, -30] + ORIGIN), rtol=1e-12)
    free = plain.dataset(15, " 17 1 1 8 1.5 2.5 3.5")
    found = read_universal(put(tmp_path, free, plain.function(F, Y)), "mm")
    np.testing.assert_allclose(found.functions.points["17"], (0.0015, 0.0025, 0.0035))


LOCAL = plain.units(1000, 1000) + plain.systems([(7, 0, np.vstack([TURNED, ORIGIN])), (8, 1, np.vstack([TURNED, ORIGIN]))])
PLACES = plain.units(1000, 1000) + plain.points([(1, 0, 7, tuple(PLACE)), (3, 0, 8, tuple(PLACE)), (2, 0, 0, (0.0, 0.0, 0.0))])


@pytest.mark.parametrize("files", [(LOCAL, PLACES, GOOD), (GOOD, PLACES, LOCAL), (LOCAL + PLACES, GOOD)])
def test_axes_and_points_of_one_file_hold_for_the_others(tmp_path: Path, files: tuple[bytes, ...]) -> None:
    turned = plain.function(F, Y, response=(3, 2), reference=(2, 1))
    found = import_files([put(tmp_path, data, name=f"{k}.unv") for k, data in enumerate((*files, turned))])
    one = read_universal(put(tmp_path, *files, turned), "m/s^2 per N").functions
    ends = {end.point: end.direction for end in found.functions.responses}
    np.testing.assert_allclose(ends["1"], TURNED[:, 2], atol=1e-12)
    np.testing.assert_allclose(ends["3"], TURNED @ slope(1, TURNED.T @ (PLACE - ORIGIN), 1), atol=1e-8)
    assert set(found.functions.responses) == set(one.responses)
    assert found.functions.points == one.points


@pytest.mark.parametrize("columns", [3, 6])
def test_modes_are_turned_into_the_axes_of_the_measurement(tmp_path: Path, columns: int) -> None:
    local = np.arange(1.0, 2 * columns + 1).reshape(2, columns)
    mode = MeasuredMode(complex(-2, 50), ("1", "2"), local + 0j)
    write_universal(measured(0.25).between(0.25, 1.0), tmp_path / "m.unv", [mode])
    data = (tmp_path / "m.unv").read_bytes()
    other = put(tmp_path, data[data.index(b"    -1\n    55") :], name="modes.unv")
    found = read_universal([other, put(tmp_path, LOCAL, PLACES, GOOD)], "m/s^2 per N, mm").modes[0]
    wanted = np.array([np.concatenate([TURNED @ row for row in local[0].reshape(-1, 3)]), local[1]])
    np.testing.assert_allclose(found.shape, wanted, rtol=1e-5)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("ordinate", "narrow"), [(5, False), (6, False), (6, True)])
def test_a_wrong_byte_order_is_told(tmp_path: Path, order: str, ordinate: int, narrow: bool) -> None:
    y = (1 + 0.3j) * RNG.normal(size=N)
    data = plain.function_bytes(F, y, order, narrow, ordinate=ordinate, even=not narrow)
    read_universal(put(tmp_path, data))
    told, right = (1, 2) if order == "<" else (2, 1)
    text = message_of(lambda: read_universal(put(tmp_path, cut(data, b"58b%6d" % told, b"58b%6d" % right))))
    assert f"(type 58b, line 1): line 2: byte order {right} is wrong: " in text
    assert text.endswith(f"% of its values are beyond all reason, and 0% with {told}; write {told} behind 58b")


def test_points_of_several_components_are_kept_apart(tmp_path: Path) -> None:
    """One number in two components is two points; where there is no doubt the number is the name."""
    ends = [((1, 3), ("LEG1", "LEG1")), ((1, 3), ("LEG2", "NONE")), ((4, 3), ("LEG2", "NONE"))]
    functions = [plain.function(F, Y, response=end, names=names) for end, names in ends]
    place = plain.units() + plain.points([(1, 0, 0, X), (2, 0, 0, Z)])
    found = read_universal(put(tmp_path, place, *functions))
    assert found.functions.labels == ["LEG1-1:+z / 2:-x", "LEG2-1:+z / 2:-x", "4:+z / 2:-x"]
    assert found.functions.points == {"2": Z}
    assert "no position is given of 3 points: LEG1-1, LEG2-1, 4" in found.notes
    turned = LOCAL + plain.points([(1, 0, 7, X)])
    text = message_of(lambda: read_universal(put(tmp_path, turned, *functions)))
    assert "LEG1 and LEG2 have a point 1 each, which moves along coordinate system 7" in text
    alone = read_universal(put(tmp_path, place, functions[0])).functions
    assert (alone.labels, alone.points) == (["1:+z / 2:-x"], {"1": X, "2": Z})


def test_units_that_contradict_themselves_are_as_declared(tmp_path: Path) -> None:
    path = put(tmp_path, plain.units(1, 1, 5), plain.points([(1, 0, 0, X)]), GOOD)
    found = read_universal(path, "g per N, mm").functions
    np.testing.assert_allclose(found.values[0], G * Y, rtol=1e-11)
    assert found.points == {"1": (1e-3, 0.0, 0.0)}
    for code, length, force in ((1, 1, 1), (5, 1000, 1000), (7, 1 / 0.0254, 0.22480894), (10, 1000, 1), (9, 7, 3)):
        read_universal(put(tmp_path, plain.units(length, force, code), GOOD), "g per N")


@pytest.mark.parametrize("records", [0, 1, 5, 6, 7])
def test_headers_that_are_short_are_read(tmp_path: Path, records: int) -> None:
    found = read_universal(put(tmp_path, plain.dataset(151, *["machine", "", "x", "1", "2", "analyser", "3"][:records]), GOOD))
    words = ["machine"] * (records > 0) + ["analyser"] * (records > 5)
    assert found.functions.source == "a.unv" + (f" ({', '.join(words)})" if words else "")


def test_coherence_goes_with_its_function(tmp_path: Path) -> None:
    low = np.linspace(0.5, 1, N)
    spectra = plain.function(F, Y.real, ordinate=2, kind=2, types=(18, 12, 0))
    path = put(
        tmp_path,
        plain.function(F, low, kind=6, ordinate=2, types=(18, 0, 0), labels=NO_LABELS, response=(3, 1)),
        plain.function(F, Y),
        plain.function(F, 2 * Y, response=(3, 1)),
        plain.function(F, low, kind=6, ordinate=4, types=(18, 0, 0), labels=NO_LABELS, response=(9, 1)),
        spectra,
        plain.dataset(82, "nothing"),
    )  # fmt: skip
    found = import_files([path], least_coherence=0.7)
    coherence = found.functions.coherence
    assert coherence is not None
    assert np.isnan(coherence[0]).all()
    np.testing.assert_allclose(coherence[1], low, atol=1e-5)
    np.testing.assert_array_equal(found.doubtful, [np.zeros(N, dtype=bool), low < 0.7])
    count = int((low < 0.7).sum())
    assert f"coherence is below 0.7 at {count} lines of function 3:+x / 2:-x ({count}); these lines are in doubt" in found.notes
    assert "no coherence is given of function 1:+z / 2:-x" in found.notes
    assert [(one.number, one.what) for one in found.unused] == [
        (4, "coherence of no function"), (5, "auto spectrum"), (6, "trace lines"),
    ]  # fmt: skip


def test_coherence_is_looked_for_in_the_file_of_its_function_first(tmp_path: Path) -> None:
    low = np.linspace(0.5, 1, N)
    of = {"kind": 6, "ordinate": 4, "types": (18, 0, 0), "labels": NO_LABELS}
    one = put(tmp_path, plain.function(F, Y, types=(18, 11, 13), labels=("Hz", "m/s", "N")), name="one.unv")
    two = put(tmp_path, GOOD, plain.function(F, low, **of), name="two.unv")
    coherence = read_universal([one, two]).functions.coherence
    np.testing.assert_allclose(coherence, [np.full(N, np.nan), low])
    apart = put(tmp_path, plain.function(F, low**2, **of), name="apart.unv")
    np.testing.assert_allclose(read_universal([apart, one, two]).functions.coherence, [low**2, low])


def test_files_are_joined_and_pairs_told_twice(tmp_path: Path) -> None:
    one = put(tmp_path, plain.function(F, Y), name="one.unv")
    two = put(tmp_path, plain.function(F, 2 * Y), plain.function(F, Y, response=(4, 1)), name="two.unv")
    found = read_universal([one, two])
    assert found.functions.labels == ["1:+z / 2:-x", "4:+x / 2:-x"]
    np.testing.assert_allclose(found.functions.values, [1.5 * Y, Y], rtol=1e-11)
    places = f"{one}: dataset 1 (type 58, line 1) and {two}: dataset 1 (type 58, line 1)"
    assert found.remarks == (
        f"1:+z / 2:-x is measured twice, in {places}: the mean is taken, from which they differ by 33.33%",
    )
    known = Functions(**{**found.functions.__dict__, "coherence": np.full((2, N), 0.4), "points": {"4": X}})
    save_functions(known, tmp_path / "three.nc")
    again = import_files([two, tmp_path / "three.nc", one], least_coherence=0.5)
    assert again.functions.points == {"4": X}
    assert again.functions.source == "two.unv; one.unv; two.unv; one.unv", "in the order of the files"
    assert again.units == ("m/s^2 per N, m/s^2/N",) * 2
    assert "1:+z / 2:-x is measured 3 times, in" in again.notes[0]
    np.testing.assert_allclose(again.functions.values, [1.5 * Y, Y], rtol=1e-11)
    np.testing.assert_array_equal(read_functions(two).values[1], found.functions.values[1])
    assert f"{one}: is given twice" in message_of(lambda: import_files([one, two, one]))


def test_the_axis_of_six_digits() -> None:
    np.testing.assert_array_equal(even_axis(0.0, 0.195313, 6401), 0.1953125 * np.arange(6401))
    np.testing.assert_array_equal(even_axis(0.195312, 0.195312, 10), 0.1953125 * np.arange(1, 11))
    np.testing.assert_array_equal(even_axis(10.0, 0.1, 5), 10 + 0.1 * np.arange(5))
    np.testing.assert_array_equal(even_axis(0.0, 0.333333, 5), 0.333333 * np.arange(5))
    np.testing.assert_array_equal(even_axis(0.0, 0.1953128, 5), 0.1953128 * np.arange(5)), "more digits than six are kept"
    assert first_difference(F, F * (1 + 4e-6)) is None
    assert first_difference(F, F * (1 + 3e-5)) == "line 1 is at 1 Hz and at 1.00003 Hz"
    assert first_difference(F, F[:-1]) == f"they have {N} and {N - 1} lines"


@given(st.integers(1, 4000), st.integers(0, 8), st.integers(0, 300))
def test_steps_of_analysers_are_found(numerator: int, power: int, start: int) -> None:
    step = numerator / 2**power
    axis = step * np.arange(start, start + 50)
    first = float(f"{axis[0]:.5e}")
    found = even_axis(first, float(f"{step:.5e}"), 50)
    half = 0.5 * 10.0 ** (math.floor(math.log10(step)) - 5)
    assert abs((found[1] - found[0]) - step) <= half * 1.001
    if step < 40 * 2.0**-power / 80 or len(str(numerator * 5**power).rstrip("0")) <= 5:
        np.testing.assert_array_equal(np.diff(found), np.diff(axis))


def measured(step: float, first: int = 1) -> Functions:
    f = step * np.arange(first, first + 40)
    values = RNG.normal(size=(3, 40)) + 1j * RNG.normal(size=(3, 40))
    coherence = RNG.uniform(0.2, 1, size=(3, 40))
    coherence[1] = np.nan
    ends = (Channel("3", (0.0, 0.0, -1.0)), Channel("4", X, True), Channel("3", (0.0, 1.0, 0.0)))
    points = {"1": (0.1, 0.2, 1 / 3), "3": (-1e-3, 0.0, 0.0), "4": (math.pi, 0.0, 0.0)}
    loads = (Channel("1", X), Channel("1", X, True), Channel("1", (-1.0, 0.0, 0.0)))
    return Functions(f, values, ("acceleration", "velocity", "displacement"), ends, loads, points, coherence, "hammer test µ")


MODES = (
    MeasuredMode(-1.5 + 100j, ("1", "3"), np.array([[1, 2j, 3], [0.125, -1, 1e-9]]), "first"),
    MeasuredMode(complex(-2, 50), ("1",), np.arange(6.0)[None] + 0j),
)


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize(("step", "first"), [(0.25, 0), (0.1953125, 1), (0.1234567, 7)])
def test_round_trip_of_every_dataset(tmp_path: Path, binary: bool, step: float, first: int) -> None:
    path, source = tmp_path / "out.unv", measured(step, first)
    if not binary and step == 0.1234567:
        assert "more than the six digits of text" in message_of(lambda: write_universal(source, path))
        assert list(tmp_path.iterdir()) == []
        return
    write_universal(source, path, MODES, binary=binary)
    found = read_universal(path)
    ours = found.functions
    assert (ours.motions, ours.responses, ours.references) == (source.motions, source.responses, source.references)
    assert ours.points == source.points
    np.testing.assert_array_equal(ours.frequency, source.frequency)
    assert ours.coherence is not None
    compare = (
        np.testing.assert_array_equal if binary else (lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-11))
    )
    compare(ours.values, source.values)
    compare(ours.coherence, source.coherence)
    assert "hammer test µ" in ours.source
    for mode, known in zip(found.modes, MODES, strict=True):
        np.testing.assert_allclose(
            [mode.pole, mode.frequency, mode.damping], [known.pole, known.frequency, known.damping], rtol=1e-5
        )
        np.testing.assert_allclose(mode.shape, known.shape, rtol=1e-5, atol=1e-20)
        assert mode.points == known.points
    assert found.modes[0].title == "first"


def test_written_files_by_other_parsers(tmp_path: Path) -> None:
    """A parser of fixed columns, which trusts the declared number of bytes, and pyuff by itself."""
    path, source = tmp_path / "out.unv", measured(0.1234567)
    write_universal(source, path, MODES[:1], binary=True)
    kinds, contents = zip(*plain.read(path.read_bytes()), strict=True)
    assert kinds == (151, 164, 2411, 58, 58, 58, 58, 58, 55)
    assert contents[1][:2] == [1, 1]
    np.testing.assert_array_equal(np.array(contents[2])[:, [0, 4, 5, 6]], [[int(k), *at] for k, at in source.points.items()])
    np.testing.assert_array_equal(contents[3], plain.numbers(source.frequency, source.values[0], False))
    assert source.coherence is not None
    np.testing.assert_array_equal(contents[4], plain.numbers(source.frequency, source.coherence[0], False))
    np.testing.assert_allclose(contents[8][:2], [-1.5, 100])
    direct = pyuff.UFF(str(path)).read_sets(3)
    np.testing.assert_array_equal(direct["data"], source.values[0])
    assert (direct["rsp_node"], direct["rsp_dir"], direct["ref_dir"], direct["ordinate_axis_units_lab"]) == (3, -3, 1, "m/s^2")
    assert (direct["orddenom_spec_data_type"], direct["func_type"]) == (13, 4)


def test_modes(tmp_path: Path) -> None:
    """Normal modes by frequency and damping, complex ones by their pole, whichever of a pair it is."""
    rows = ["NONE", "second bending", "", "NONE", "NONE", "", "         2         4         1         2"]
    normal = [*rows, f"{12.5:13.5E}{1:13.5E}{0.02:13.5E}{0:13.5E}", f"{3:10d}", f"{1:13.5E}{-2:13.5E}{0.5:13.5E}"]
    normal[5] = "".join(f"{k:10d}" for k in (1, 2, 2, 8, 2, 3))
    pair = [*normal[:6], "         2         6         1         1", "".join(f"{c:13.5E}" for c in (-0.5, -40, 0, 0, 0, 0))]
    pair[5] = "".join(f"{k:10d}" for k in (1, 3, 2, 8, 5, 3))
    pair += [f"{3:10d}", "".join(f"{c:13.5E}" for c in (1, 2, 3, 4, 5, -6))]
    put(tmp_path, plain.dataset(55, *normal), plain.dataset(55, *pair))
    one, two = read_universal([put(tmp_path, GOOD, name="b.unv"), tmp_path / "a.unv"]).modes
    assert (one.title, one.points) == ("second bending", ("3",))
    np.testing.assert_allclose([one.frequency, one.damping], [12.5, 0.02])
    np.testing.assert_array_equal(one.shape, [[1, -2, 0.5]])
    assert two.pole == -0.5 + 40j
    np.testing.assert_array_equal(two.shape, [[1 - 2j, 3 - 4j, 5 + 6j]])
    assert "found: 2 modes" in message_of(lambda: read_universal(tmp_path / "a.unv"))


def cut(data: bytes, old: bytes, new: bytes, times: int = 1) -> bytes:
    assert old in data
    return data.replace(old, new, times)


MODE_LINES = [*["NONE"] * 5, "".join(f"{k:10d}" for k in (1, 3, 2, 8, 5, 3)), "         2         6         1         1"]
MODE_LINES += ["".join(f"{c:13.5E}" for c in row) for row in ((-0.5, 40, 0, 0, 0, 0),)]
MODE_LINES += [f"{3:10d}", "".join(f"{c:13.5E}" for c in (1, 2, 3, 4, 5, -6))]
IN_BYTES = plain.function_bytes(F, Y)
LINES = GOOD.split(b"\n")
WRONG: dict[str, tuple[bytes, str]] = {
    "empty": (b"", 'holds no dataset; a universal file begins with a line of "    -1"'),
    "no universal file": (b"frequency,1\n", 'line 1: "frequency,1" stands outside any dataset; expected "    -1"'),
    "no end": (
        GOOD.rsplit(b"    -1", 1)[0],
        'dataset 1 (type 58, line 1): is cut off: the file ends before its closing "    -1"',
    ),
    "cut in the second": (GOOD + GOOD[:900], "dataset 2 (type 58, line 27): is cut off"),
    "end left out": (GOOD + cut(GOOD, b"    -1\n", b"") + GOOD, 'line 27: "58" stands outside any dataset'),
    "no type": (b"    -1\n  type\n    -1\n", 'dataset 1, line 2: "type" is no type of a dataset'),
    "short": (b"\n".join([*LINES[:16], *LINES[18:]]), "declares 23 points, which are 46 numbers; holds 38"),
    "long": (b"\n".join([*LINES[:16], LINES[14], *LINES[16:]]), "declares 23 points, which are 46 numbers; holds 50"),
    "words": (cut(GOOD, LINES[15][:20], b"abc".rjust(20)), "(type 58, line 1): line 16: "),
    "columns": (
        cut(GOOD, LINES[15], b" " + LINES[15][:-20] + LINES[15][-20:].lstrip()),
        "numbers do not stand in the columns of their form",
    ),
    "bytes cut": (IN_BYTES[:900], "dataset 1 (type 58b, line 1): is cut off: declares 23 points, which are 368 bytes"),
    "bytes short": (cut(IN_BYTES, b"        23", b"        21"), "declares 21 points, which are 336 bytes; no closing"),
    "bytes as text": (cut(IN_BYTES, IN_BYTES.split(b"\n")[1], b"    58"), "is marked as text (58), but its values are bytes"),
    "text as bytes": (
        cut(GOOD, b"    58\n", b"    58b     1     2          11         368     0     0           0           0\n"),
        "(type 58b, line 1): line 14: is marked as bytes (58b), but its values are text",
    ),
    "VAX": (cut(IN_BYTES, b"58b     1     2", b"58b     1     1"), "kind of floats 1"),
    "NaN": (cut(GOOD, LINES[15][20:40], b"NaN".rjust(20)), "line 16: frequency line 5 (at 2 on its abscissa) is not finite"),
    "infinite bytes": (
        plain.function_bytes(F, np.where(np.arange(N) == 6, np.inf, Y)),
        "frequency line 7 (at 2.5 on its abscissa) is not finite",
    ),
    "falling": (plain.function(F[::-1], Y, even=False), "frequency line 2 is at 6.25; expected 0 or more, rising"),
    "real": (plain.function(F, Y.real, ordinate=4), "values are real; a frequency response has real and imaginary parts"),
    "direction": (plain.function(F, Y, response=(1, 0)), "line 8: direction of its response is 0; expected +-1 to +-3"),
    "reference direction": (plain.function(F, Y, reference=(1, 7)), "direction of its reference is 7"),
    "no reference": (plain.function(F, Y, reference=(0, 0)), "line 8: names no reference"),
    "reference a motion": (plain.function(F, Y, types=(18, 12, 12)), "its reference is a motion (type 12); expected a load"),
    "reference is pressure": (plain.function(F, Y, types=(18, 12, 15)), "its reference is of type 15; expected a load"),
    "response a load": (plain.function(F, Y, types=(18, 13, 13)), "its response is a load; expected 8 displacement"),
    "time": (plain.function(F, Y, types=(17, 12, 13)), "its abscissa is of type 17; expected 18, frequency"),
    "rpm": (plain.function(F, Y, labels=("furlong", "m/s^2", "N")), '"furlong" is no unit of frequency'),
    **{
        word: (plain.function(F, Y, labels=(word, "m/s^2", "N")), f'"{word}" is no unit of frequency; expected Hz, kHz, cps or')
        for word in ("s^-1", "1/s", "Bq", "rpm", "s", "MHZ")
    },
    "gigahertz": (plain.function(1e9 * F, Y), "frequencies go up to 6.5e+09 Hz; expected at most 1e+09 Hz"),
    "step of 1e30": (plain.function(1e30 * F, Y), "frequencies go up to 6.5e+30"),
    "1 is SI": (
        plain.units(1000, 1000, 1) + GOOD,
        "line 3: contradiction: code 1 says m and N, its factors 0.001 m and 0.001 N",
    ),
    "5 is mm": (plain.units(1, 1, 5) + GOOD, "contradiction: code 5 says mm and mN, its factors 1 m and 1 N; say what holds"),
    "a blank in a factor": (plain.units(1000, 2.5).replace(b"2.500", b"2.5\t0", 1) + GOOD, "line 4: "),
    "no units": (
        plain.function(F, Y, labels=NO_LABELS),
        "neither labels nor a dataset 164 tell its units; say what they are, as in --units",
    ),
    "no kinds": (plain.units() + plain.function(F, Y, labels=NO_LABELS, types=(18, 1, 1)), "neither types nor labels say what"),
    "half a label": (plain.function(F, Y, labels=("Hz", "g", "NONE")), 'units "g per none" are not those of an acceleration'),
    "strange label": (
        plain.function(F, Y, labels=("Hz", "V", "N")),
        'units "V per N" are not those of an acceleration per load',
    ),
    "label of another": (plain.function(F, Y, labels=("Hz", "m/s", "N")), 'units "m/s per N" are not those of an acceleration'),
    "contradiction": (
        plain.units(1000, 1) + GOOD,
        'contradiction: its labels say "m/s^2 per N", dataset 164 counts lengths in 0.001 m',
    ),
    "g and SI": (plain.units() + plain.function(F, Y, labels=("Hz", "g", "N")), 'contradiction: its labels say "g per N"'),
    "exponents": (
        plain.function(F, Y, exponents=((0, 1), (0, 1))),
        "exponents of length and force of its response are 0 and 1",
    ),
    "two systems of units": (plain.units() + plain.units(1000, 1) + GOOD, "other units than in dataset 1"),
    "factor zero": (plain.units(0, 1) + GOOD, "factor of length 0.0; expected above zero"),
    "points without unit": (plain.points([(1, 0, 0, (1, 2, 3))]) + GOOD, "no dataset 164 tells in which unit points lie"),
    "points twice": (
        plain.units() + 2 * plain.points([(1, 0, 0, X)]).replace(b"1.0", b"1.0") + plain.points([(1, 0, 0, Z)]) + GOOD,
        "point 1 is at (0, 0, 1000) mm here, at (1000, 0, 0) mm before",
    ),
    "no system": (
        plain.units() + plain.points([(1, 0, 9, X)]) + GOOD,
        "point 1 moves along coordinate system 9, which no dataset 2420",
    ),
    "on the axis": (
        plain.units() + plain.systems([(9, 1, np.eye(4)[:, :3])]) + plain.points([(1, 0, 9, Z)]) + GOOD,
        "lies on the axis",
    ),
    "point along two": (
        plain.units()
        + plain.systems([(9, 0, np.eye(4)[:, :3])])
        + plain.points([(1, 0, 9, X), (2, 0, 0, X)])
        + plain.points([(2, 0, 0, X), (1, 0, 0, X)])
        + GOOD,
        "point 1 moves along coordinate system 0 here, along 9 before (",
    ),
    "system twice": (
        plain.systems([(9, 0, np.eye(4)[:, :3])]) + plain.systems([(9, 0, np.vstack([TURNED, ORIGIN]))]) + GOOD,
        "coordinate system 9 is another one here than before (",
    ),
    "system elsewhere": (
        plain.systems([(9, 0, np.eye(4)[:, :3]), (9, 0, np.vstack([np.eye(3), X]))]) + GOOD,
        "coordinate system 9 is another one here than before (",
    ),
    "label of a point": (
        plain.units() + plain.dataset(2411, "1.7 0 0 8", "1.0 2.0 3.0") + GOOD,
        'line 9: "1.7 0 0 8": expected',
    ),
    "label of a system": (
        plain.systems([(9, 0, np.eye(4)[:, :3])]).replace(b"         9", b"       1.7") + GOOD,
        'line 5: "1.7 0 8": expected integers for labels',
    ),
    "number of a point": (
        GOOD.replace(b"         1   3", b"       1.7   3", 1),
        'line 8: "1.7": expected an in',
    ),
    "left-handed": (
        plain.units() + plain.systems([(9, 0, np.vstack([-np.eye(3), Z]))]) + GOOD,
        "not square to each other, or left-handed",
    ),
    "curved position": (
        plain.units() + plain.systems([(9, 1, np.eye(4)[:, :3])]) + plain.old_points([(1, 9, 0, X)]) + GOOD,
        "its angles have no stated unit",
    ),
    "bad point": (plain.units() + plain.dataset(2411, "1 0 0 8", "1.0 2.0") + GOOD, 'line 10: "1.0 2.0": expected 3 numbers'),
    "other frequencies": (GOOD + plain.function(F + 0.5, Y), "dataset 1 (type 58, line 1) and "),
    "fewer lines": (GOOD + plain.function(F[:-1], Y[:-1]), f"they have {N} and {N - 1} lines"),
    "coherence elsewhere": (
        GOOD + plain.function(F + 0.5, Y.real**2 / 2, kind=6, ordinate=4),
        "line 1 is at 1 Hz and at 1.5 Hz",
    ),
    "coherence of 2": (
        GOOD + plain.function(F, np.full(N, 2.0), kind=6, ordinate=4),
        "coherence 2 at frequency line 1; expected 0 to 1",
    ),
    "mode out of its columns": (
        plain.dataset(55, *MODE_LINES[:-1], MODE_LINES[-1][4:]) + GOOD,
        ": expected 6 numbers",
    ),
    "millions": (cut(GOOD, b"        23", b"  23000000"), "23000000 points; functions are read up to 1000000"),
    "no function": (plain.units(), "no frequency response function (type 58, function type 4); found: nothing else"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_files_are_told_with_dataset_and_line(tmp_path: Path, case: str) -> None:
    data, message = WRONG[case]
    text = message_of(lambda: read_universal(put(tmp_path, data)))
    assert message in text
    assert text.startswith(str(tmp_path / "a.unv"))


@pytest.mark.parametrize(
    "units", ["m/s^2 per N, g per N", "mm, in", "m/s^2", "m/s^2 per m", "N per m/s^2", "mm per", "fish", "m/s^2 per N, kg", ""]
)
def test_wrong_units_as_declared(tmp_path: Path, units: str) -> None:
    text = message_of(lambda: read_universal(put(tmp_path, GOOD), units))
    assert text.startswith(f'--units "{units}"')
    assert 'write for example "m/s^2 per N"' in text


def test_units_as_declared_have_to_fit(tmp_path: Path) -> None:
    assert "its response is an acceleration" in message_of(lambda: read_universal(put(tmp_path, GOOD), "mm/s per N"))


def test_a_file_of_a_gigabyte_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "large.unv"
    path.touch()
    os.truncate(path, 2**30)
    monkeypatch.setattr(Path, "read_bytes", lambda self: pytest.fail("was read"))
    assert f"has 1024 MiB; universal files are read up to {LARGEST // 2**20} MiB" in message_of(lambda: read_universal(path))
    assert LARGEST == 512 * 2**20


def test_paths_that_are_no_files(tmp_path: Path) -> None:
    assert "is not a regular file" in message_of(lambda: read_universal(tmp_path))
    assert "cannot be read" in message_of(lambda: read_universal(tmp_path / "none.unv"))
    assert "no file is given" in message_of(lambda: import_files([]))


def test_what_cannot_be_written_is_told(tmp_path: Path) -> None:
    good, path = measured(0.25), tmp_path / "out.unv"

    def change(**values: Any) -> Functions:
        return Functions(**{**good.__dict__, **values})

    gap = np.array(good.values)
    gap[1, 3] = np.nan
    half = np.full((3, 40), 0.5)
    half[0, 3] = np.nan
    oblique = (Channel("3", (0.6, 0.8, 0.0)), *good.responses[1:])
    for wrong, message in (
        (change(values=gap), "4:+rx / 1:+rx has values that are not finite"),
        (change(coherence=half), "the coherence of 3:-z / 1:+x has gaps"),
        (change(responses=oblique), "lies along no axis"),
        (change(points={"tip": X}), 'point "tip" is no number'),
        (good.between(1.0, 1.0), "1 lines; a file holds 1 at 2 at least"),
    ):
        assert message in message_of(lambda wrong=wrong: write_universal(wrong, path))
    both = MeasuredMode(-1 + 9j, ("1",), np.full((1, 6), 1j))
    assert "mode 1 is complex and has rotations" in message_of(lambda: write_universal(good, path, [both]))
    assert list(tmp_path.iterdir()) == []
    path.touch()
    assert "exists already" in message_of(lambda: write_universal(good, path))
    write_universal(good, path, overwrite=True)
    assert is_even(read_universal(path).functions.frequency)

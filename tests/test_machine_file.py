"""Machine files: what is wrong is refused in one line that names the key, the value and the remedy; what is right is kept."""

from __future__ import annotations

import math
import os
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from documents import ABSENT, message_of, same, validator, with_change, written

from trivet.model import catalogue, dimensions, document_of, load, parse, to_text, write

MACHINES = catalogue()
LINK = "chains/leg/elements/link"
SLIDE = "chains/leg/elements/slide"
HINGE = "chains/leg/elements/hinge"
BALL = "chains/leg/elements/ball"
ELEMENT = "chains.leg.elements"
ELEMENTS = "chains/leg/elements"
TWIN = {"name": "link", "type": "offset", "vector": ["0 mm", "0 mm", "0 mm"]}
FREE = {"name": "guide", "type": "curvilinear", "radius": "1 m"}
BALL_ONLY = {"name": "ball", "type": "spherical"}
CROSS = {"name": "cross", "type": "universal", "axes": ["x", "y"]}

# What is changed in azulay.toml, to what, what the message must hold, and whether an editor can tell by the schema.
REFUSED: dict[str, tuple[str, Any, tuple[str, ...], bool]] = {
    "unknown key": (f"{LINK}/lenght", "1 mm", (f"{ELEMENT}.link.lenght: unknown key", "did you mean 'length'?"), True),
    "unknown table": ("platfrom", {}, ("platfrom: unknown key", "did you mean 'platform'?"), True),
    "unknown key, far from all": ("home/zzz", 1, ("home.zzz: unknown key", "azimuth, mode, position, roll, tilt"), True),
    "missing key": (f"{LINK}/length", ABSENT, (f"{ELEMENT}.link.length: this key is needed and missing",), True),
    "missing table": ("home", ABSENT, ("home: this key is needed and missing",), True),
    "missing type": (f"{LINK}/type", ABSENT, (f"{ELEMENT}.link.type: this key is needed and missing",), True),
    "no unit": (f"{LINK}/length", "216", (f'{ELEMENT}.link.length: "216": the unit is missing', 'example "216 mm"'), True),
    "bare number": (f"{LINK}/length", 216, ("link.length: 216: the unit is missing", '"216 mm"'), True),
    "other dimension": (f"{LINK}/length", "216 N", ("link.length: \"216 N\": 'N' is not a unit of length", '"216 mm"'), False),
    "other dimension, angle": ("home/tilt", "5 mm", ("home.tilt: \"5 mm\": 'mm' is not a unit of angle", '"70 deg"'), True),
    "unknown unit": (f"{LINK}/length", "216 furlogs", ("'furlogs' is not a unit of length",), False),
    "percentage as angle": ("home/tilt", "5 %", ("'%' is not a unit of angle",), True),
    "tower of powers": (f"{LINK}/length", "1 m**9**9**9", ("'m**9**9**9' is not a unit of length",), False),
    "negative length": (f"{LINK}/length", "-216 mm", ('link.length: "-216 mm": must be greater than zero',), True),
    "zero length": (f"{LINK}/length", "0 mm", ('link.length: "0 mm": must be greater than zero',), False),
    "length below all floats": (f"{LINK}/length", "1e-400 mm", ('"1e-400 mm": must be greater than zero',), False),
    "negative radius": ("chains/leg/platform_joint/radius", "-1 mm", ('"-1 mm": must not be negative',), True),
    "NaN": (f"{LINK}/length", "nan mm", ('"nan mm": expected a finite number',), True),
    "infinity": (f"{LINK}/length", "inf mm", ('"inf mm": expected a finite number',), True),
    "beyond all floats": (f"{LINK}/length", "1e999 mm", ('"1e999 mm": expected a finite number',), False),
    "not a number": (f"{LINK}/length", "long", ('link.length: "long": expected a number and a unit',), True),
    "NaN ratio": ("materials/steel/poisson_ratio", math.nan, ("poisson_ratio: nan: expected a finite number", "0.29"), False),
    "huge ratio": ("materials/steel/poisson_ratio", 10**400, ("poisson_ratio: 10", "is beyond all reason"), False),
    "unprintable ratio": ("materials/steel/poisson_ratio", 16**9999, ("int of great size is beyond all",), False),
    "ratio with unit": ("materials/steel/poisson_ratio", "29 mm", ("'mm' is not a unit of ratio",), True),
    "too compressible": ("materials/steel/poisson_ratio", 0.5, ("materials.steel.poisson_ratio: 0.5 is not below 0.5",), False),
    "thick wall": ("sections/tube/inner_diameter", "19 mm", ("inner_diameter: 19 mm is not smaller", "diameter 19 mm"), False),
    "travel reversed": (
        f"{SLIDE}/travel",
        ["65 mm", "0 mm"],
        ("slide.travel: runs from 65 mm to 0 mm; write the lower",),
        False,
    ),
    "travel of one": (f"{SLIDE}/travel", ["65 mm"], ("slide.travel: ['65 mm'] has too few entries",), True),
    "elevation past upright": (f"{HINGE}/travel", ["5 deg", "100 deg"], ("hinge.travel: 5 deg to 100 deg", "90 deg"), False),
    "cone of nothing": (f"{BALL}/cone", "-70 deg", ("ball.cone: -70 deg does not lie between 0 deg and 180 deg",), False),
    "unknown section": (f"{LINK}/section", "tub", ('link.section: "tub" is not defined', "did you mean 'tube'?"), False),
    "unknown section of a slide": (f"{SLIDE}/beam/section", "rod", (f'{ELEMENT}.slide.beam.section: "rod" is not',), False),
    "unknown material": (f"{LINK}/material", "stel", ('link.material: "stel" is not', "did you mean 'steel'?"), False),
    "unknown material of the disc": ("platform/disc/material", "tin", ('platform.disc.material: "tin" is not',), False),
    "unknown type": (f"{LINK}/type", "bem", ('link.type: "bem" is not known', "did you mean 'beam'?"), True),
    "unknown shape": ("sections/tube/shape", "tub", ('sections.tube.shape: "tub" is not known', "'tube'"), True),
    "unknown axis": (f"{LINK}/axis", "w", ('link.axis: "w": expected an axis: one of x, -x, y',), True),
    "axis of no length": (f"{LINK}/axis", [0, 0, 0], ("link.axis: [0, 0, 0]: expected an axis", "not all zero"), False),
    "axis of NaN": (f"{LINK}/axis", [math.nan, 0.0, 1.0], ("link.axis: [nan, 0.0, 1.0]: expected an axis",), False),
    "unknown word": (f"{HINGE}/measure", "slope", ("hinge.measure: \"slope\" is not known; expected 'angle' or",), True),
    "name with a capital": (f"{LINK}/name", "Link", ('elements.Link.name: "Link": a name is lower case letters',), True),
    "chain with a blank in its name": ("chains", {"a b": {}}, ('chains.a b: "a b": a name is lower case',), True),
    "text where true or false": (f"{SLIDE}/actuated", "yes", ('slide.actuated: "yes" where true or false was expected',), True),
    "text where a number": ("chains/leg/copies", "3", ('chains.leg.copies: "3" where a whole number was expected',), True),
    "text where a list": ("home/position", "0 mm", ('home.position: "0 mm" where a list was expected',), True),
    "text where a table": ("home", "here", ('home: "here" where a table was expected',), True),
    "table where text": ("about/title", {"en": "x"}, ("about.title: {'en': 'x'} where text was expected",), True),
    "no copies": ("chains/leg/copies", 0, ("chains.leg.copies: 0 is not at least 1",), True),
    "too many copies": ("chains/leg/copies", 25, ("chains.leg.copies: 25 is not at most 24",), True),
    "later format": ("format", 2, ("format: 2 is not known; expected 1",), True),
    "no chains": ("chains", {}, ("chains: {} has fewer than 1 entries",), True),
    "one name twice": (
        "chains/leg/elements/2/name",
        "link",
        (f"{ELEMENT}.link.name: two elements", "give each its own"),
        False,
    ),
    "starts with a body": (ELEMENTS, [TWIN, CROSS], (f"{ELEMENT}.link: a chain starts with a joint", 'type "offset"'), False),
    "ends with a body": (ELEMENTS, [CROSS, TWIN], (f"{ELEMENT}.link: a chain ends with a joint", 'type "offset"'), False),
    "one element": (ELEMENTS, [CROSS], (f"{ELEMENT}: [", "has fewer than 2 entries"), True),
    "nowhere to stand": (
        ELEMENTS,
        [CROSS, TWIN, CROSS | {"name": "b"}],
        ("chains.leg.base: needed", 'azimuth = "0 deg"'),
        False,
    ),
    "nothing drives": (f"{ELEMENTS}", [FREE, BALL_ONLY], ("chains.leg: no joint of this chain is actuated; set",), False),
    "oblique cross": (ELEMENTS, [CROSS | {"axes": ["x", "x"]}, TWIN], ("cross.axes: the two axes are not at right",), False),
    "misspelt known material": (f"{LINK}/material", "steel-1081", ('link.material: "steel-1081"', "'steel-1018'"), False),
    "mass twice": ("platform/mass", "1 kg", ("platform.mass: given together with platform.disc; keep one of them",), False),
    "inertia alone": ("platform", {"inertia": ["1 kg mm^2"] * 3}, ("platform.inertia: needs platform.mass",), False),
    "elastic without a rate": (f"{BALL}/rotation", "elastic", ("ball.stiffness: needed, and missing",), False),
    "rate without elastic": (f"{BALL}/stiffness", "1 N m/rad", ('ball.stiffness: goes with rotation = "elastic" only',), False),
    "source of another kind": ("home/tilt", {"value": "1 deg", "source": 5}, ("home.tilt.source: 5 where text",), True),
    "status unknown": ("home/tilt", {"value": "1 deg", "status": "giben"}, ('status: "giben" is not known',), True),
    "beside a value": ("home/tilt", {"value": "1 deg", "sourc": "x"}, ('home.tilt: unknown key "sourc"', "'source'"), True),
    "source of a table": ("home", {"value": {"tilt": "1 deg"}}, ("home.value: {'tilt': '1 deg'} where text",), True),
    "source of a name": (f"{LINK}/type", {"value": "beam"}, ("link.type: a table; sources stand beside dimensions",), True),
    "source in a list": ("home/position", [{"value": "1 mm"}] * 3, ("home.position: write one source beside the",), True),
    "notes of one's own": ("about/notes", [], ("about.notes: unknown key; sources are written beside",), True),
    "settings without a parent": ("set", {}, ("set: unknown key",), True),
    "value of several lines": ("theory", "a\nb", ('theory: "a\\nb" is not known',), True),
    "key of several lines": ("home/a\nb", 1, ("home.a\\nb: unknown key",), True),
    "long value": ("theory", "x" * 10_000, ("theory: ", "…", "is not known"), True),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_values_are_refused(case: str) -> None:
    path, value, fragments, _ = REFUSED[case]
    text = message_of(lambda: parse(with_change(written("azulay"), path, value)))
    for fragment in fragments:
        assert fragment in text


@pytest.mark.parametrize("case", [case for case, (*_, by_schema) in REFUSED.items() if by_schema])
def test_schema_refuses_what_an_editor_can_see(case: str) -> None:
    path, value, _, _ = REFUSED[case]
    assert not validator().is_valid(with_change(written("azulay"), path, value))


@pytest.mark.parametrize("name", MACHINES)
def test_catalogue_fits_the_schema(name: str) -> None:
    for document in (written(name), document_of(load(name))):
        assert [f"{e.json_path}: {e.message}" for e in validator().iter_errors(document)] == []


@pytest.mark.parametrize("name", MACHINES)
def test_a_written_machine_reads_back_the_same(name: str, tmp_path: Path) -> None:
    machine = load(name)
    write(machine, tmp_path / "copy.toml")
    again = load(tmp_path / "copy.toml")
    assert same(machine, again)
    assert to_text(again) == to_text(machine)


def test_a_variant_needs_its_parent_only() -> None:
    assert validator().is_valid({"variant_of": "azulay"})
    assert validator().is_valid({"variant_of": "azulay", "set": {"link.length": "196 mm"}})
    assert not validator().is_valid({})
    assert not validator().is_valid({"variant_of": 1})


def file(folder: Path, text: str, name: str = "machine.toml") -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


FILES: dict[str, tuple[bytes, tuple[str, ...]]] = {
    "empty": (b"", ("about: this key is needed and missing; also ", "; also home: this key is needed and missing")),
    "not UTF-8": (b'title = "\xff"', ("is not UTF-8 text; a machine file is TOML",)),
    "syntax": (b"format = 1\n[about\n", ("is not TOML: ", "line 2")),
    "key twice": (b"format = 1\nformat = 1\n", ("is not TOML: ", "line 2")),
    "nested lists": (b"a = " + b"[" * 50_000, ("nested too deeply",)),
    "nested tables": (b"a" + b".a" * 5_000 + b" = 1", ("nested too deeply",)),
    "keys of many parts": (b"a" + b".1" * 200_000 + b" = 1", ("nested too deeply",)),
    "just too deep": (b"a = " + b"[" * 20 + b"]" * 20, ("nested too deeply; a machine file has at most 16",)),
    "huge integer": (b"format = " + b"1" * 5_000, ("is not TOML: a whole number of thousands of digits",)),
    "huge hexadecimal integer": (b"format = 0x" + b"f" * 5_000, ("format: int of great size is not known; expected 1",)),
    "date": (b"format = 1979-05-27", ("format: datetime.date(1979, 5, 27) is not known; expected 1",)),
    "variant of nothing known": (b'variant_of = "azuley"', ("azuley: no machine of this name", "did you mean 'azulay'")),
    "variant of no file": (b'variant_of = "none.toml"', ("none.toml: cannot be read: No such file",)),
    "variant of a number": (b"variant_of = 1", ("variant_of: 1 where the name of a machine was expected",)),
    "variant of itself": (b'variant_of = "machine.toml"', ("machine.toml: varies itself: ",)),
    "settings no table": (b'variant_of = "azulay"\nset = 1', ("set: 1 where a table of key paths was expected",)),
    "unknown setting": (b'variant_of = "azulay"\n[set]\n"link.lenth" = "1 m"', ("set: link.lenth: no such", "'link.length'")),
    "unquoted setting": (
        b'variant_of = "azulay"\n[set]\nlink.length = "1 m"',
        ("set: link: a table; a key path", '"link.length"'),
    ),
    "bad setting": (b'variant_of = "azulay"\n[set]\n"link.length" = "1 N"', ("link.length: \"1 N\": 'N' is not a unit",)),
}


@pytest.mark.parametrize("case", FILES)
def test_bad_files_are_refused(case: str, tmp_path: Path) -> None:
    data, fragments = FILES[case]
    path = tmp_path / "machine.toml"
    path.write_bytes(data)
    text = message_of(lambda: load(path))
    assert text.startswith(str(tmp_path))
    for fragment in fragments:
        assert fragment in text


def test_variants_in_a_circle_and_without_end(tmp_path: Path) -> None:
    file(tmp_path, 'variant_of = "b.toml"', "a.toml")
    file(tmp_path, 'variant_of = "a.toml"', "b.toml")
    assert "a.toml: varies itself: " in message_of(lambda: load(tmp_path / "a.toml"))
    for i in range(9):
        file(tmp_path, f'variant_of = "v{i + 1}.toml"', f"v{i}.toml")
    assert "more than 4 times over" in message_of(lambda: load(tmp_path / "v0.toml"))


def test_a_variant_of_a_file_beside_it(tmp_path: Path) -> None:
    file(tmp_path, to_text(load("azulay")), "parent.toml")
    child = file(tmp_path, 'variant_of = "parent.toml"\n[set]\n"link.length" = "200 mm"')
    assert dimensions(load(child))["chains.leg.elements.link.length"] == 0.2
    assert same(load(child, {"link.length": "216 mm"}), load("azulay"))


def test_a_huge_file_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.toml"
    with path.open("wb") as stream:
        stream.truncate(100_000_000)
    tracemalloc.start()
    try:
        assert "huge.toml: larger than 1000000 bytes" in message_of(lambda: load(path))
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_a_deep_file_is_refused_before_settings_are_sought_in_it(tmp_path: Path) -> None:
    path = file(tmp_path, "a" + ".a" * 5_000 + " = 1")
    assert "nested too deeply" in message_of(lambda: load(path, {"home.tilt": "1 deg"}))


def test_a_long_value_is_quoted_in_short() -> None:
    text = message_of(lambda: parse(with_change(written("azulay"), "theory", "x" * 10_000)))
    assert len(text) < 200


def test_an_axis_is_normalised_once() -> None:
    rng = np.random.default_rng(1)
    for size in (1e-300, 1.0, 7.0, 1e300):
        for direction in rng.normal(size=(50, 3)):
            given = [float(c) for c in direction * size]
            once = document_of(parse(with_change(written("azulay"), f"{LINK}/axis", given)))
            (axis,) = (e["axis"] for e in once["chains"]["leg"]["elements"] if e["name"] == "link")
            np.testing.assert_allclose(axis, direction / np.linalg.norm(direction), rtol=1e-14)
            assert document_of(parse(once)) == once


@pytest.mark.parametrize(
    ("name", "fragments"),
    [
        ("azuley", ("azuley: no machine of this name in the catalogue; did you mean 'azulay' or", "a file ends in .toml")),
        ("", (": no machine of this name in the catalogue; known are: alizade",)),
        ("/", ("/: is a folder; a machine file was expected",)),
        ("missing.toml", ("missing.toml: cannot be read: No such file or directory",)),
        ("a\0b.toml", ("a\\x00b.toml: cannot be read: embedded null byte",)),
        ("a" * 5000 + ".toml", ("cannot be read: File name too long",)),
        ("a\nb", ("a\\nb: no machine of this name",)),
    ],
)
def test_names_of_no_machine(name: str, fragments: tuple[str, ...]) -> None:
    text = message_of(lambda: load(name))
    for fragment in fragments:
        assert fragment in text


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(tmp_path: Path) -> None:
    path = file(tmp_path, "")
    Path(path).chmod(0)
    assert "cannot be read: Permission denied" in message_of(lambda: load(path))


@pytest.mark.parametrize(
    ("path", "value", "fragments"),
    [
        ("radius", "1 mm", ("azulay: radius: ambiguous; it could be chains.leg.elements.guide.radius or",)),
        ("link.lenght", "1 mm", ("azulay: link.lenght: no such key in this machine; did you mean 'link.length'",)),
        ("guide.bearing.q", "1 N/um", ("azulay: guide.bearing.q: no such key in this machine; did you mean 'guide.bearing.",)),
        (
            "link.bearing.z",
            "1 N/um",
            ("link.bearing: unknown key; known are: axis, length, material, name, section, shapes, type",),
        ),
        ("gide.bearing.z", "1 N/um", ("azulay: gide.bearing.z: no such key in this machine; did you mean 'guide.bearing.z'",)),
        ("guide.friction.z", "1", ("azulay: guide.friction.z: no such key in this machine",)),
        ("", "1 mm", ("azulay: : unknown key",)),
        ("home.elevation", "1 deg", ("azulay: home.elevation: unknown key",)),
        ("link.length", "1 kg", ("azulay: chains.leg.elements.link.length: \"1 kg\": 'kg' is not a unit of length",)),
        ("link.length.value", "1 mm", ("azulay: link.length.value: no such key",)),
        ("chains", "1 mm", ('azulay: chains: "1 mm" where a table was expected',)),
    ],
)
def test_bad_settings_are_refused(path: str, value: str, fragments: tuple[str, ...]) -> None:
    text = message_of(lambda: load("azulay", {path: value}))
    for fragment in fragments:
        assert fragment in text


@pytest.mark.parametrize("path", ["link.length", "leg.link.length", "chains.leg.elements.link.length", "elements.link.length"])
def test_abbreviated_settings(path: str) -> None:
    assert dimensions(load("azulay", {path: "20 cm"}))["chains.leg.elements.link.length"] == 0.2


@pytest.mark.parametrize("path", ["guide.bearing.z", "chains.leg.elements.guide.bearing.z"])
def test_a_setting_may_add_a_table_that_is_not_there(path: str) -> None:
    machine = load("azulay", {path: "2.4 N/um", "guide.bearing.ry": "3e4 N m/rad"})
    found = dimensions(machine)
    assert found["chains.leg.elements.guide.bearing.z"] == 2.4e6
    assert found["chains.leg.elements.guide.bearing.ry"] == 3e4


def test_a_setting_may_add_what_is_not_there() -> None:
    machine = load("azulay", {"home.tilt": "180 deg", "chains.leg.elements.link.length": "1 km"})
    assert machine.home.tilt == math.pi
    assert dimensions(machine)["chains.leg.elements.link.length"] == 1000
    machine = load("azulay", {"slide.mass": "2 kg", "ball.loss_factor": "0.1", "platform.tool_tip": "0 mm, 1 mm, -5 cm"})
    _, slide, *_, ball = machine.chains["leg"].elements
    assert (slide.mass, ball.loss_factor, machine.platform.tool_tip) == (2.0, 0.1, (0.0, 0.001, -0.05))


def test_a_file_with_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "bom.toml"
    path.write_bytes(b"\xef\xbb\xbf" + to_text(load("azulay")).encode())
    assert same(load(path), load("azulay"))


def test_a_known_material_needs_no_definition() -> None:
    document: dict[str, Any] = with_change(written("azulay"), f"{LINK}/material", "titanium-ti6al4v")
    assert dimensions(parse(document))["materials.titanium-ti6al4v.youngs_modulus"] == 113.8e9


def test_writing_never_replaces_unasked(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    write(load("azulay"), path)
    assert "exists already" in message_of(lambda: write(load("eclipse"), path))
    assert load(path).name == "azulay"
    write(load("eclipse"), path, overwrite=True)
    assert load(path).name == "eclipse"
    assert [p.name for p in tmp_path.iterdir()] == ["m.toml"]
    assert "is a folder" in message_of(lambda: write(load("azulay"), tmp_path, overwrite=True))

"""The paper's numbers, and what is said of ours beside them: transcription, verdicts, orders, statements."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import pytest
import scipy.stats
from documents import message_of
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter

from trivet.model import catalogue, load
from trivet.reproduce.found import Found, Ours
from trivet.reproduce.numbers import NONE, Number, number, unit_named
from trivet.reproduce.ordering import Moments, greatest_p, holds, ordering
from trivet.reproduce.outcome import Outcome
from trivet.reproduce.paper import Claim, Item, Pair, Reason, default_paper, read_paper
from trivet.reproduce.verdict import BANDS, of_statement, verdict_of

# The tables of the paper's text, copied a second time.
TABLES = {
    "table-1": """
        base radius R_b | mm | 162
        platform radius R_p | mm | 18
        link length L | mm | 216
        travel on the circle θ | deg | 360
        radial travel d − R_b, least | mm | 0
        radial travel d − R_b, greatest | mm | 65
        hinge φ, least | deg | 5
        hinge φ, greatest | deg | 70
        ball joint, ± | deg | 70""",
    "fig-4": "",
    "table-2": """
        mean K_xx | N/um | 5.74 5.69 5.28
        variance K_xx | N^2/um^2 | 0.24 0.38 0.39
        mean K_yy | N/um | 5.49 4.73 4.21
        variance K_yy | N^2/um^2 | 0.22 0.33 0.33
        mean K_zz | N/um | 8.77 5.43 3.92
        variance K_zz | N^2/um^2 | 1.18 0.21 0.10""",
    "table-3": """
        base radius R_b | mm | 162 162 162 162
        platform radius R_p | mm | 18 18 18 18
        link length | mm | 216 216 216 130
        travel on the circle θ | deg | 360 360 360 360
        radial travel d − R_b | mm | 65 65 65 –
        hinge φ, least | deg | 5 5 5 5
        hinge φ, greatest | deg | 70 70 70 70
        ball joint, ± | deg | 70 70 70 70""",
    "table-3-tilt": """
        tilt | deg | 94 98 96 96""",
    "table-4": """
        mean K_xx | N/um | 5.691 4.450 3.686 2.433
        variance K_xx | N^2/um^2 | 0.349 0.237 0.028 0.020
        mean K_yy | N/um | 4.710 3.986 3.247 2.038
        variance K_yy | N^2/um^2 | 0.316 0.100 0.103 0.053
        mean K_zz | N/um | 5.690 7.360 3.601 5.487
        variance K_zz | N^2/um^2 | 0.228 0.004 0.108 0.292""",
    "fig-10": "",
    "table-5": """
        D_xx | N/um | 0.178 0.044 0.047 0.015
        D_yy | N/um | 0.161 0.041 0.071 0.021
        D_zz | N/um | 0.066 0.567 2.08 0.005""",
}
TABLES["fig-10"] = TABLES["table-5"]  # the peaks of the one are the values of the other
FOUR = ("azulay", "eclipse", "alizade", "glozman")
COLUMNS = {"table-1": FOUR[:1], "fig-4": FOUR[:1], "table-2": ("azulay-196", "azulay", "azulay-236")}


def item(name: str) -> Item:
    (found,) = default_paper().chosen([name])
    return found


@pytest.mark.parametrize("name", TABLES)
def test_the_data_file_says_what_the_paper_says(name: str) -> None:
    """Digit by digit, noughts at the end included."""
    expected = {}
    for line in TABLES[name].strip().splitlines():
        quantity, unit, digits = (part.strip() for part in line.split("|"))
        expected[quantity] = [None if text == NONE else (text, unit) for text in digits.split()]
    own = item(name)
    assert {v.quantity: [n and (n.text, n.unit.name) for n in v.paper] for v in own.values} == expected
    assert own.machines == COLUMNS.get(name, FOUR)


def test_every_table_and_figure_is_there() -> None:
    assert {own.name for own in default_paper().items} == {*TABLES, "fig-3", "fig-8", "fig-12"}
    assert {own.where.partition(",")[0] for own in default_paper().items} == {f"Table {n}" for n in range(1, 6)} | {
        f"Fig {n}" for n in (3, 4, 8, 10, 12)
    }


@pytest.mark.parametrize("name", catalogue())
def test_machine_files_publish_the_same(name: str) -> None:
    """What machine files hold as published and what the data file holds are one thing."""
    for own in load(name).about.published:
        asked = {a.quantity: a.paper[name] for a in item(_item_of(own.source)).asked}
        for kind, value in (("mean", own.mean), ("variance", own.variance)):
            found = asked[f"{kind} {own.quantity}"]
            assert found is not None
            assert found.value == value
    for one in load(name).about.published_dynamic:
        (found,) = (a.paper[name] for a in item(_item_of(one.source)).asked if a.quantity == one.quantity)
        assert found is not None
        assert found.value == one.minimum


def _item_of(source: str) -> str:
    return source.partition(", ")[2].lower().replace(" ", "-")


def printed(text: str) -> Number:
    found = number(text)
    assert found is not None
    return found


@given(st.integers(-10_000, 10_000), st.integers(0, 4), st.floats(-0.4999, 0.4999))
def test_a_number_stands_for_all_that_round_to_it(whole: int, decimals: int, part: float) -> None:
    own = printed(f"{whole / 10**decimals:.{decimals}f} N/um")
    step = 10.0**-decimals * 1e6
    assert own.half == pytest.approx(step / 2)
    assert own.rounds_to(own.value + part * step)
    assert not own.rounds_to(own.value + 0.51 * step)


@pytest.mark.parametrize("text", ["5.74", "5.74 N", "N/um", "abc N/um", "nan N/um", "inf mm", "", 5.74, None])
def test_what_is_no_number_is_refused(text: object) -> None:
    with pytest.raises(ValueError, match=r"expected|is not a unit|is no number|unit is missing"):
        TypeAdapter(Number).validate_python(text)


@given(st.floats(0.01, 1e4), st.floats(-2, 2), st.booleans())
def test_a_verdict_follows_from_the_deviation(size: float, apart: float, keeps_order: bool) -> None:
    """Reproduced up to the greatest band and not beyond, the least band that holds it; the order counts only then."""
    own = printed(f"{size:.6f} N/um")
    verdict = verdict_of(own, own.value * (1 + apart), keeps_order, "of the weather")
    if own.rounds_to(own.value * (1 + apart)):
        assert verdict.words == "reproduced to its digits"
    elif abs(apart) <= BANDS[-1] * (1 - 1e-9):
        (told,) = (band for band in BANDS if verdict.words == f"reproduced within {100 * band:g} %")
        assert abs(apart) <= told * (1 + 1e-9)
        assert all(abs(apart) > band * (1 - 1e-9) for band in BANDS if band < told)
        assert not verdict.reason
    elif abs(apart) > BANDS[-1] * (1 + 1e-9):
        assert verdict.kind == ("ordering" if keeps_order else "not reproducible")
        assert verdict.sentence.endswith("because of the weather")


def test_without_a_number_there_is_no_verdict_and_without_ours_none_that_is_good() -> None:
    assert verdict_of(None, 1.0, True, "").kind == "no number"
    assert verdict_of(printed("0 mm"), 0.0, False, "").kind == "reproduced"
    assert verdict_of(printed("5 mm"), None, True, "x").kind == "not reproducible"
    assert verdict_of(printed("0 mm"), 0.01, False, "x").kind == "not reproducible"


NAMES = "abcde"
distinct = st.lists(st.integers(1, 99), min_size=2, max_size=5, unique=True)


@given(distinct, st.floats(0.1, 10))
def test_orders(sizes: Sequence[int], scale: float) -> None:
    """Any scale keeps an order, the mirror image turns every pair round, a machine without a number is in no order."""
    known = {name: printed(f"{size} mm") for name, size in zip(NAMES, sizes, strict=False)}
    pairs = len(known) * (len(known) - 1) // 2
    same = {name: scale * own.value for name, own in known.items()}
    assert ordering("q", "s", known, same)[-3:] == (pairs, pairs, 0)
    mirrored = {name: -value for name, value in same.items()}
    assert ordering("q", "s", known, mirrored).agreeing == 0
    first, *_ = same
    assert ordering("q", "s", known, {n: v for n, v in same.items() if n != first})[-3:] == (pairs - (len(known) - 1), pairs, 1)


def test_digits_hide_an_order() -> None:
    known = {"a": printed("0.33 N/um"), "b": printed("0.33 N/um"), "c": printed("0.22 N/um")}
    found = ordering("q", "s", known, {"a": 1.0, "b": 2.0, "c": 0.5})
    assert (found.paper, found.ours, found.agreeing, found.pairs) == ("a = b > c", "b > a > c", 2, 2)
    assert found.is_reproduced
    assert not ordering("q", "s", {"a": known["a"], "b": known["b"]}, {"a": 1.0, "b": 2.0}).is_reproduced


def test_statements() -> None:
    claim = Claim("", order="a > b, c")
    assert claim.pairs == [Pair("a", "b"), Pair("a", "c")]
    assert Claim("", order="a, b > c > d").pairs == [Pair("a", "c"), Pair("b", "c"), Pair("c", "d")]
    assert holds(claim, {"a": 3, "b": 1, "c": 2})
    assert holds(claim, {"a": 3, "b": 4, "c": 2}) is False
    assert holds(claim, {"a": 3, "b": 1}) is None, "c has none, and may be anywhere"
    assert holds(claim, {"a": 3}) is None
    reach = Claim("", at_least=printed("90 deg"), machines=("a", "b"))
    assert holds(reach, {"a": math.radians(91), "b": math.radians(90.1), "c": 0})
    assert holds(reach, {"a": math.radians(91), "b": math.radians(89)}) is False
    assert holds(reach, {"a": math.radians(91)}) is None, "b has none"
    for anyone in (Claim("", at_least=printed("90 deg")), Claim("", about=printed("2 mm"))):
        assert holds(anyone, {}) is None
    assert holds(Claim("", reason="nobody knows"), {"a": 1}) is None
    assert of_statement(None, None, True, "nobody knows").sentence == "not reproducible, because nobody knows"
    assert of_statement(False, False, True, "x").sentence == "does not hold, nor in the paper's own table"


def test_significance_is_that_of_scipy() -> None:
    """The greater of two p values after Holm's correction, from moments only."""
    samples = {"a": Moments(317, 5.7, 0.35), "b": Moments(317, 5.6, 0.30), "c": Moments(317, 5.59, 0.03)}
    raw = [
        scipy.stats.ttest_ind_from_stats(
            *((m := samples["a"]).mean, (m.variance * 317 / 316) ** 0.5, 317),
            *((m := samples[other]).mean, (m.variance * 317 / 316) ** 0.5, 317),
            equal_var=False,
        ).pvalue
        for other in "bc"
    ]
    expected = max(2 * min(raw), max(raw))
    pairs = [Pair("a", "b"), Pair("a", "c")]
    assert greatest_p(pairs, samples) == pytest.approx(expected, rel=1e-9)
    means = {name: own.mean for name, own in samples.items()}
    for level in (0.5 * expected, 2 * expected):
        assert holds(Claim("", order="a > b, c", significance=level), means, samples) is (level > expected)
    assert holds(Claim("", order="b > a", significance=0.5), means, samples) is False
    assert holds(Claim("", order="a > b", significance=0.5), means) is None


def outcome(claims: tuple[Claim, ...] = (), **ours: float | None) -> Outcome:
    """Table 4's K_zz, with numbers of ours in settings "first" and "other"."""
    own = item("table-4")
    rows = [Ours("mean K_zz", name, "first", ours.get(name), "N/um") for name in own.machines]
    rows += [Ours("mean K_zz", name, "other", ours.get(f"{name}_other"), "N/um") for name in own.machines]
    values = tuple(dataclasses.replace(one, fitted=False) for one in own.values)
    return Outcome(dataclasses.replace(own, claims=claims, values=values), Found(tuple(rows)))


def test_numbers_beside_the_paper() -> None:
    found = outcome(azulay=5.69e6, eclipse=7.4e6, alizade=5.1e6, glozman=5.4e6, azulay_other=1e6, eclipse_other=9e6)
    azulay, eclipse, alizade, glozman = found.rows
    assert azulay.verdict.words == "reproduced to its digits"
    assert eclipse.verdict.words == "reproduced within 1 %"
    assert alizade.verdict.kind == "ordering", "all pairs are in order"
    assert glozman.verdict.words == "reproduced within 2 %"
    assert (azulay.least, azulay.greatest) == (1e6, 5.69e6)
    assert (glozman.least, glozman.greatest) == (5.4e6, 5.4e6)
    assert azulay.deviation == pytest.approx(0)
    first, other = found.orderings
    assert (first.agreeing, first.pairs, first.is_reproduced) == (6, 6, True)
    assert (other.agreeing, other.is_reproduced) == (1, False)
    in_order = {f"{name}_other": value for name, value in zip(FOUR, (3e6, 4e6, 1e6, 2e6), strict=True)}
    turned = outcome(azulay=5.3e6, eclipse=7.4e6, alizade=5.1e6, glozman=5.4e6, **in_order)
    assert turned.rows[2].verdict.kind == "not reproducible", "azulay and glozman have changed places, but in the other setting"


def test_statements_count_settings_and_look_at_the_papers_own_table() -> None:
    claims = (
        Claim("x", ("mean K_zz",), "azulay > alizade"),
        Claim("y", ("mean K_zz",), "azulay > eclipse"),
        Claim("z", reason="nobody knows"),
    )
    x, y, z = outcome(claims, azulay=5.0, alizade=4.0, eclipse=6.0, azulay_other=3.0, alizade_other=4.0).statements
    assert (x.verdict.words, x.holding, x.settings, x.in_paper) == ("holds", 1, 2, True)
    assert (y.verdict.words, y.in_paper) == ("does not hold, nor in the paper's own table", False)
    (one, *_) = outcome(claims, azulay=5.0, alizade=4.0).statements
    assert (one.holding, one.settings, one.left_out) == (1, 1, 1), "the other setting has no numbers"
    (one, *_) = outcome(claims, azulay=5.0, alizade=4.0, azulay_other=5.0).statements
    assert (one.holding, one.settings, one.left_out) == (1, 1, 1), "the other setting has one of two, which says nothing"
    assert (z.verdict.reason, z.settings, z.in_paper) == ("nobody knows", 0, None)


@given(st.floats(0.1, 100), st.floats(-0.5, 0.5))
def test_about_a_number_is_within_a_quarter_of_it(size: float, apart: float) -> None:
    own = printed(f"{size:.4f} mm")
    claim = Claim("", about=own, machines=("a",))
    if abs(abs(apart) - 0.25) > 1e-6:
        assert holds(claim, {"a": own.value * (1 + apart), "b": 0}) is (abs(apart) < 0.25)


def test_the_ring_is_one_statement() -> None:
    """The text has no number that is exact; what comes out beside it are radii of ours."""
    rows = [Ours(f"{which} radius", "azulay", "s", size, "mm") for which, size in (("mean", 2.3e-3), ("greatest", 2.9e-3))]
    found = Outcome(item("fig-4"), Found(tuple(rows)))
    (one,) = found.statements
    assert (one.quantity, one.expected, one.verdict.words) == ("mean radius", "about 2 mm", "holds")
    assert found.summary == "1 of 1 statement holds"


def test_inputs_are_no_results() -> None:
    """As put in, or not, and counted apart; an order of inputs is none."""
    own = item("table-3")
    rows = [
        Ours(asked.quantity, name, "as described", known and known.value * (2 if name == "eclipse" else 1), known.unit.name)
        for asked in own.asked[2:4]
        for name, known in asked.paper.items()
        if known is not None
    ]
    rows.append(Ours("hinge φ, least", "glozman", "as described", None, "deg"))
    found = Outcome(own, Found(tuple(rows)))
    words = {(row.machine, row.verdict.kind, row.verdict.words) for row in found.rows}
    assert ("azulay", "input", "as put in") in words
    assert ("eclipse", "input", "put in otherwise") in words
    assert ("glozman", "input", "not put in") in words
    assert found.rows[-1].verdict.reason
    assert found.summary == "6 of 9 inputs as put in"
    assert not found.orderings


def test_what_is_met_by_a_fit_is_no_result() -> None:
    """z0 is fitted to means: met or missed, and counted apart; variances are judged as they are."""
    own = item("table-4")
    rows = [
        Ours(asked.quantity, name, "s", known.value * (1.06 if name == "alizade" else 1.04), known.unit.name)
        for asked in own.asked[:2]
        for name, known in asked.paper.items()
        if known is not None
    ]
    found = Outcome(dataclasses.replace(own, claims=()), Found(tuple(rows)))
    kinds = {(row.quantity.partition(" ")[0], row.machine): (row.verdict.kind, row.verdict.words) for row in found.rows}
    assert kinds["mean", "azulay"] == ("fit", "met by a fit")
    assert kinds["mean", "alizade"] == ("fit", "missed by a fit")
    assert kinds["variance", "azulay"] == ("reproduced", "reproduced within 5 %")
    assert kinds["variance", "alizade"][0] == "ordering"
    assert all(bool(row.verdict.reason) is (row.machine == "alizade") for row in found.rows)
    assert found.summary.startswith("3 of 4 fitted numbers met, 3 of 4 numbers reproduced")


@pytest.mark.parametrize("name", TABLES)
def test_numbers_that_machine_files_were_fitted_to_are_told_to_be(name: str) -> None:
    """Their notes say which: the means of the static stiffness; and the tilts have a sphere fitted to each."""
    fitted = {asked.quantity for asked in item(name).asked if asked.is_fitted}
    means = {asked.quantity for asked in item(name).asked if asked.quantity.startswith("mean K_")}
    assert fitted == ({"tilt"} if name == "table-3-tilt" else means)


def test_the_greatest_tilts_are_put_in_order_and_the_nearest_set_beside_the_digits() -> None:
    own = item("table-3-tilt")
    nearest, greatest = (90, 91, 92, 93), (95, 178, 120, 119)
    rows = [
        Ours(quantity, name, quantity, math.radians(size), "deg")
        for quantity, sizes in (("tilt", nearest), ("greatest tilt", greatest))
        for name, size in zip(FOUR, sizes, strict=True)
    ]
    found = Outcome(own, Found(tuple(rows)))
    (order,) = found.orderings
    assert (order.quantity, order.paper) == ("greatest tilt", "eclipse > alizade = glozman > azulay")
    assert order.is_reproduced
    met, missed = "met by a fit", "missed by a fit"
    assert [row.verdict.words for row in found.rows[:4]] == [met, missed, met, met], "z0, radius and axis are fitted to them"
    assert {row.verdict.kind for row in found.rows[4:]} == {"no number"}
    (one,) = found.statements
    assert (one.quantity, one.verdict.words, one.in_paper) == ("greatest tilt", "holds", True)


@pytest.mark.parametrize(
    ("name", "shown", "si", "factor"),
    [("N^2/um^2", "(N/µm)²", "N^2/m^2", 1e12), ("kN/mm", "kN/mm", "N/m", 1e6), ("um", "µm", "m", 1e-6), ("", "", "", 1)],
)
def test_units_are_those_of_machine_files(name: str, shown: str, si: str, factor: float) -> None:
    unit = unit_named(name)
    assert (unit.shown, unit.quantity.si) == (shown, si)
    assert unit.factor == pytest.approx(factor, rel=1e-15)


def test_ours_are_told_in_the_units_of_the_paper() -> None:
    own = item("table-4")
    found = Outcome(own, Found(tuple(Ours("mean K_zz", name, "s", 5e6, "N/mm") for name in own.machines)))
    assert {row.unit.text(row.ours) for row in found.rows} == {"5.000"}


def test_the_first_reason_that_applies_is_told() -> None:
    own = dataclasses.replace(
        item("table-4"), reasons=(Reason("one", machines=("azulay",)), Reason("two", ("mean K_zz",)), Reason("three"))
    )
    assert own.reason("mean K_zz", "azulay") == "one"
    assert own.reason("mean K_zz", "eclipse") == "two"
    assert own.reason("mean K_xx", "eclipse") == "three"


def test_every_item_with_numbers_has_a_reason_for_each() -> None:
    """Whatever deviates some day is not left without a word."""
    for own in default_paper().items:
        for asked in own.asked:
            for name, paper_number in asked.paper.items():
                assert paper_number is None or asked.is_input or own.reason(asked.quantity, name)


FILE = """
citation = "x"
[[items]]
name = "one"
where = "Table 1"
title = "t"
setting = "s"
command = "c"
machines = ["azulay"]
work = { kind = "dimensions" }
"""


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("kind = ", "sort = "), "work.kind: this key is needed and missing"),
        (('"dimensions"', '"dimension"'), "is not known; did you mean 'dimensions'"),
        (('"azulay"]', '"azulay"]\nvalues = [{ quantity = "q", paper = ["5 mm", "6 mm"] }]'), "as many entries as there are"),
        (
            ('"azulay"]', '"azulay"]\nvalues = [{ quantity = "q", paper = ["5"] }]'),
            "the unit is missing; write for example 5.74 N/um",
        ),
        (('"azulay"]', '"azulay"]\nclaims = [{ text = "t", order = "azuley > azulay" }]'), "did you mean 'azulay'"),
        (('"azulay"]', '"azulay"]\ncolour = "red"'), "items.one.colour: unknown key"),
        (('"azulay"]', '"azulay"]\nvalues_of = "two"'), "two"),
        (('name = "one"', 'name = "One"'), "items.One.name"),
    ],
)
def test_a_wrong_data_file_is_refused(change: tuple[str, str], told: str) -> None:
    assert read_paper(FILE.encode(), "own.toml").items[0].name == "one"
    message = message_of(lambda: read_paper(FILE.replace(*change).encode(), "own.toml"))
    assert message.startswith("own.toml: ")
    assert told in message


@pytest.mark.parametrize("name", [name for name, text in TABLES.items() if text])
def test_the_paper_beside_itself(name: str) -> None:
    """Its own numbers in place of ours: all are reproduced, all orders, and what it says holds where its table bears it out."""
    own = item(name)
    rows = [
        Ours(quantity, machine, "the paper", known.value, known.unit.name)
        for asked in own.asked
        for quantity in dict.fromkeys((asked.quantity, asked.ordered_by))
        for machine, known in asked.paper.items()
        if known is not None
    ]
    points = [Ours("points", machine, "the paper", 317.0, "") for machine in own.machines]
    found = Outcome(own, Found((*rows, *points)))
    fitted = {asked.quantity for asked in own.asked if asked.is_fitted}
    words = "as put in" if own.work.kind == "dimensions" else "reproduced to its digits"
    told = {(row.quantity in fitted, row.verdict.words) for row in found.rows if row.paper is not None}
    assert told <= {(False, words), (True, "met by a fit")}
    assert all(order.agreeing == order.pairs for order in found.orderings)
    for one in found.statements:
        assert (one.verdict.words == "holds") is one.in_paper, one.text
    if name == "table-4":
        refuted = [(one.quantity, "significance" in one.text) for one in found.statements if not one.in_paper]
        assert refuted == [("mean K_zz", True)], "Eclipse is stiffer along z, in the paper's own table"
        significant = [one.ours for one in found.statements if "significance" in one.text]
        assert all(float(words.rpartition(" p ")[2]) < 0.01 for words in significant), "every pair differs by its digits"

"""Locks and drives: rates near the fold of the prototype, sets that are equal, places a drive can be told, home."""

from __future__ import annotations

import io
import math
from functools import cache
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from rich.console import Console
from test_locks import fewer, held_at, sets, task

import trivet as t
from trivet.kinematics.drive_rates import MOST_RATE
from trivet.kinematics.freedoms import ChainScrews, Sampled
from trivet.kinematics.held import Held, ease_piece, ways
from trivet.kinematics.jacobian import homogenised_inverse
from trivet.space.pose import zyz_frame
from trivet.statics.structure import structural_stiffness
from trivet.study import lock_advice
from trivet.study.lock_advice import LocksAdvised, _ordered, advise_locks
from trivet.study.lock_best import LockAdvice, _limits
from trivet.study.lock_stiffness import axis_stiffness
from trivet.study.lock_values import Holding, turned
from trivet.study.locks import LockSet, _lost, lock_sets, with_drives_locked
from trivet.views import locks as view

HOME = [[0.0, 0.0, 0.125, 0.0, 0.0, 0.0]]
FOLD = 0.018 + math.sqrt(0.216**2 - 0.125**2) - 0.15
"""Where a radial stage stands that is locked with guide and tangential stage side by side, at home (m)."""
SERVING = {"leg-1.guide": 0.0, "leg-2.guide": 0.02, "leg-3.guide": -0.03}


@cache
def at_home(name: str = "K_zz") -> LocksAdvised:
    return advise_locks(fewer("leg-1").with_locks(SERVING), HOME, name)


def radial() -> Held:
    return next(way for way in ways(t.load("rmmt").with_free_drives(), 0, ("radial",)) if way.signs == (1.0, 1.0))


def test_rates_at_the_fold_by_trigonometry() -> None:
    """Locked off the fold, the tangential stage stands aside, and its way meets that of the guide at a small angle."""
    frames, rolls = zyz_frame(np.array([HOME[0][:3]]), *np.zeros((2, 1)), np.zeros(1)), np.zeros(1)
    for off in (1e-5, 1e-4, 1e-3):
        aside = math.acos((0.018 - off) / 0.018)  # the platform joint, from the radial stage, seen from the axis of the guide
        # Radial motion of the joint; a unit motion along it turns the guide by 1/(18 mm tan), and moves the stage by 1/sin.
        least = 1 / math.tan(aside)
        found = float(radial().rates(np.array([[FOLD - off]]), frames, rolls)[0])
        assert 0.7 / math.sin(aside) < least < found < 3 / math.sin(aside)
    assert float(radial().rates(np.array([[FOLD]]), frames, rolls)[0]) > 1e6


def test_a_place_at_the_fold_is_outside_and_says_so() -> None:
    way, frames = radial(), zyz_frame(np.array([HOME[0][:3]]), *np.zeros((2, 1)), np.zeros(1))
    _, margins = way.rows(ease_piece, np.array([[FOLD - off] for off in (1e-5, 1e-3)]), *_twice(frames))
    assert margins[0] < 0 < margins[1]
    pose = zyz_frame((0.0, 0.0, 0.125), 0.0, 0.0, 0.0)
    words = way.miss([FOLD - 1e-5], pose)
    assert words.startswith("a drive of leg-1 goes ")
    assert words.endswith(f"times as fast as the platform, near a Type 1 singularity; at most {MOST_RATE:g} times is allowed")
    assert way.miss([FOLD - 1e-3], pose) == ""


def _twice(frames: Any) -> tuple[Any, np.ndarray]:
    return jax.tree.map(lambda c: np.repeat(np.asarray(c), 2), frames), np.zeros(2)


def test_no_set_is_locked_at_a_singularity() -> None:
    """K_zz rises to the fold at home; every machine as advised, by the Jacobian of the machine so locked."""
    found, pose = at_home(), zyz_frame((0.0, 0.0, 0.125), 0.0, 0.0, 0.0)
    assert len(found.reached) == 3
    for advice in found.reached:
        assert advice.holding is not None
        locked = with_drives_locked(found.machine, advice.coordinates)
        signs = np.array([way.signs for way in advice.holding.ways])
        rates = np.linalg.norm(np.asarray(homogenised_inverse(locked, pose, signs)), axis=1)
        assert advice.rate == pytest.approx(rates.max(), rel=1e-6)
        assert advice.rate <= MOST_RATE * (1 + 1e-9)
    near = next(advice for advice in found.reached if advice.locks.name == "leg-1.radial")
    assert near.rate > 0.95 * MOST_RATE  # the search runs up to what is allowed, a few microns short by rounding


def test_home_is_singular_for_sets_that_lock_a_radial_stage() -> None:
    told = [one for one in sets().whole if one.at_home is not None and one.at_home < 6]
    assert (len(told), len(sets().whole)) == (19, 27)
    assert all(any("radial" in name for name in one.drives) for one in told)
    for one in sets().whole:
        assert one.at_home == 6 - sum("radial" in name for name in one.drives)
    # With the guides of the file aside no tangential stage stands in the middle, and nothing is lost.
    aside = lock_sets(t.load("rmmt").with_locks({"leg-1.guide": 0.1, "leg-2.guide": 0.1, "leg-3.guide": -0.1}))
    assert all(one.at_home == 6 for one in aside.whole)


def test_what_is_lost_is_told_at_home_where_the_rank_is_the_same() -> None:
    told = {one.drives: one.verdict for one in sets().sets}
    own = "leg-1 stops motion along (0.00, 1.00, 0.00) through (18.0, 0.0, 125.0) mm"
    for other in ("guide", "tangential", "radial"):
        assert told["leg-1.guide", "leg-1.tangential", f"leg-2.{other}"].startswith(own + ";")


def test_what_is_lost_is_told_of_the_chain_itself_and_elsewhere_where_home_is_singular_for_it() -> None:
    """Two chains, each flat at a pose of its own."""
    whole, flat = np.eye(6)[:, :5], np.eye(6)[:, [0, 1, 2, 3, 3]]
    (one, other), places = (ChainScrews(tuple("abcde"), (), columns) for columns in (whole, flat)), ((0.0, 0.0, 0.125),) * 2
    poses = tuple(zyz_frame(place, 0.0, 0.0, 0.0) for place in places)
    sampled = Sampled(t.load("rmmt").with_free_drives(), poses, ((one, other), (other, one)))
    assert [sampled.generic(k, ()) for k in (0, 1)] == [0, 1]
    turn = np.eye(6)[:, 5]
    assert [_lost(turn, sampled, at) for at in (0, 1)] == [
        "turns about (0.00, 0.00, 1.00)", "turns about (0.00, 0.00, 1.00) at a pose beside home"
    ]  # fmt: skip
    push = np.eye(6)[:, 1]
    assert _lost(push, sampled, 1) == "motion along (0.00, 1.00, 0.00) through (0.0, 0.0, 125.0) mm at a pose beside home"


def test_limits_and_losses_are_said_of_the_best() -> None:
    fast = view._cautions(made("fast", 1.0, 0.5, 0.995 * MOST_RATE), {"K_xx": 0.998, "K_zz": 2.0}, {"K_xx": 1.0, "K_zz": 1.0})
    assert fast == [
        "a drive goes 4.97 times as fast as the platform, at most 5: a singularity is near", "less than as the file locks: K_xx"
    ]  # fmt: skip
    assert view._cautions(made("calm", 1.0, 0.5), {"K_xx": 1.0}, {}) == []


def test_places_are_those_a_drive_can_be_told() -> None:
    for advice in at_home().reached:
        for name, value in advice.coordinates.items():
            shown = math.degrees(value) / 1e-3 if "guide" in name else value / 1e-6
            assert shown == pytest.approx(round(shown), abs=1e-6)
        assert advice.holding is not None
        assert advice.value == pytest.approx(advice.holding.value)  # worked out there


def test_stiffness_of_the_axes_by_the_structure() -> None:
    chosen, values = held_at(("guide", "radial", "tangential"), (0.05, -0.12, 0.2))
    poses = task()
    assert poses.rolls is not None
    found = axis_stiffness(Holding(chosen, values, poses.rolls, np.zeros(2)), poses)
    locked = with_drives_locked(
        chosen[0].machine, dict(zip((n for w in chosen for n in w.drives), values.tolist(), strict=True))
    )
    signs, held, free = np.array([way.signs for way in chosen]), [], []
    for place in range(2):
        pose = jax.tree.map(lambda c, k=place: float(c[k]), turned(poses.frames, poses.rolls))
        stiffness = structural_stiffness(locked, pose, signs)
        held.append(np.diag(stiffness)[:3])
        free.append(1 / np.diag(np.linalg.inv(stiffness))[:3])
    assert [found[f"K_{a}{a}"] for a in "xyz"] == pytest.approx(np.min(held, axis=0), rel=1e-6)
    assert [found[f"1/C_{a}{a}"] for a in "xyz"] == pytest.approx(np.min(free, axis=0), rel=1e-6)


def test_limits_are_those_of_the_worst_pose() -> None:
    chosen, values = held_at(("guide",) * 3, (0.05, -0.02, 0.03))
    holding, poses = Holding(chosen, values, np.zeros(2), np.zeros(2)), task()
    both, *each = (_limits(holding, poses.some(np.array(some))) for some in ([0, 1], [0], [1]))
    assert both[1] == pytest.approx(min(margin for _, margin, _ in each))
    assert both[2] == pytest.approx(max(rate for _, _, rate in each))
    assert abs(each[0][1] - each[1][1]) > 1e-3
    assert abs(each[0][2] - each[1][2]) > 1e-3
    back = _limits(holding, poses.some(np.array([1, 0])))
    assert back[1:] == pytest.approx(both[1:])


def made(name: str, value: float, margin: float, rate: float = 1.5) -> LockAdvice:
    locks = LockSet((name,), 6, {}, True, 6, "", 1)
    return LockAdvice(locks, "", None, at_home().best.holding, value, None, (), margin, rate)


def test_of_sets_that_are_equal_the_files_own_comes_first_then_what_has_most_to_spare() -> None:
    tight, fast, own, roomy, less = (
        made("tight", 100.0, 0.0),
        made("fast", 99.99, 0.9, 4.9),
        made("own", 99.95, 0.1),
        made("roomy", 99.92, 0.5),
        made("less", 99.8, 1.0),
    )
    every = [less, tight, fast, own, roomy]
    names = [[advice.locks.name for advice in _ordered(every, first)] for first in (own.locks, less.locks, None)]
    assert names[0] == ["own", "roomy", "fast", "tight", "less"]
    assert names[1] == names[2] == ["roomy", "own", "fast", "tight", "less"]


def test_the_locked_machine_is_written_with_its_history(trivet: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine, kept = tmp_path / "fewer.toml", tmp_path / "locked.toml"
    t.write(fewer("leg-1").with_locks(SERVING), machine)
    task = "locks", str(machine), "--position", "0 mm, 0 mm, 125 mm", "--objective", "travel"
    code, out, err = trivet(*task, "--write", str(kept))
    assert code == 0
    assert f"wrote {kept}" in err
    locked = t.load(str(kept))
    assert "for the greatest travel (one pose)." in locked.about.description
    best = at_home("travel").best
    assert locked.home.mode == best.mode
    held = {
        f"{leg.name}.{e.name}": e.locked
        for leg in locked.legs
        for e in leg.chain.elements
        if getattr(e, "locked", None) is not None
    }
    for name, value in best.coordinates.items():
        assert held[name] == pytest.approx(value, abs=1e-9)
    assert trivet("pose", str(kept))[0] == 0
    assert "drive rate" in out
    monkeypatch.delattr(lock_advice, "advise_locks")  # what cannot be written is told before the search
    code, _, err = trivet(*task, "--write", str(kept))
    assert code == 2
    assert str(kept) in err
    code, _, err = trivet("locks", str(machine), "--write", str(tmp_path / "other.toml"))
    assert (code, "--write: of advice for a task" in err) == (2, True)


def test_tables_are_narrow_and_tell_what_is_equal() -> None:
    for result in (sets(), at_home()):
        console = Console(width=160, record=True, file=io.StringIO())
        for part in view.tables(result):
            console.print(part)
        lines = [line.rstrip() for line in console.export_text().splitlines()]
        assert max(map(len, lines)) <= 100
    text = "\n".join(lines)
    assert "3 sets are equal within 0.1 %: which of them does not matter for K_zz" in text
    assert "1/C_xx" in text
    assert "the locks of the machine's file are equal within 0.1 %: there is no need for others" in text
    assert t.Goal().objective == "1/C_xx"
    assert view.places_in_short(
        t.load("rmmt"), {f"leg-{k}.tangential": v for k, v in ((1, 0.0), (2, -0.006156), (3, 0.006156))}
    ) == ("tangential 0 / -6.156 / 6.156")
    assert view.places_in_short(t.load("rmmt"), {"leg-1.guide": 0.0, "leg-3.radial": 0.0442}) == "guide 0 / - / radial 44.2"
    assert view.drives_in_short(["leg-1.guide", "leg-1.radial", "leg-2.guide"]) == "leg-1 guide radial, leg-2 guide"

"""Whose folder a reproduction may write into, and what it believes of what lies there."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from trivet.errors import InputError
from trivet.reproduce import store
from trivet.reproduce.paper import default_paper
from trivet.reproduce.run import reproduce


def again(folder: Path) -> list[str]:
    told: list[str] = []
    reproduce(default_paper(), folder, ["table-1"], tell=told.append)
    return told


def test_a_folder_with_a_readme_of_somebody_else_is_not_ours(tmp_path: Path) -> None:
    mark = tmp_path / store.FOLDER / store.MARK
    mark.parent.mkdir()
    mark.write_text("mine")
    with pytest.raises(InputError, match="holds other files"):
        again(tmp_path)
    assert mark.read_text() == "mine"


@pytest.mark.parametrize("where", [f"{store.FOLDER}/table-1.json", "report.html"])
def test_links_do_not_lead_out_of_the_folder(tmp_path: Path, where: str) -> None:
    folder, foreign = tmp_path / "own", tmp_path / "foreign"
    again(folder)
    foreign.write_text("mine")
    (folder / where).unlink(missing_ok=True)
    (folder / where).symlink_to(foreign)
    with pytest.raises(InputError, match="is a link to another place"):
        again(folder)
    assert foreign.read_text() == "mine"


def test_an_item_that_is_too_large_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    again(tmp_path)
    assert "is damaged" not in again(tmp_path)[0]
    monkeypatch.setattr(store, "MOST_BYTES", 100)
    assert "is damaged" in again(tmp_path)[0]


def test_what_an_item_says_cannot_steer_a_terminal(tmp_path: Path, trivet: object) -> None:
    again(tmp_path)
    path = tmp_path / store.FOLDER / "table-1.json"
    document = json.loads(path.read_text())
    document["inputs"]["\x1b[31mX\n"] = "1"
    path.write_text(json.dumps(document))
    code, _, err = trivet("reproduce", "--only", "table-1", "--output", str(tmp_path))  # type: ignore[operator]
    assert code == 0
    assert "\\x1b[31mX\\n" in err
    assert "\x1b" not in err

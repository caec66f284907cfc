"""Names of machines and files that are nearly right are answered by the right one; all faults of a file are told at once."""

from __future__ import annotations

from typing import Any

import pytest

from trivet.errors import InputError
from trivet.model import load
from trivet.model.complaint import LONGEST, MOST


@pytest.fixture
def bench(trivet: Any, tmp_path: Any) -> Any:
    """A folder with a machine file, bench.toml."""
    (tmp_path / "bench.toml").write_text(trivet("show", "azulay", "--toml")[1])
    return tmp_path / "bench.toml"


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        ("benhc.toml", "did you mean 'bench.toml'?"),
        ("BENHC.toml", "did you mean 'bench.toml'?"),
        ("./bnch.toml", "did you mean './bench.toml'?"),
        ("bench", "did you mean the file 'bench.toml'?"),
        ("bench.tml", "did you mean the file 'bench.toml'?"),
        ("AZULAY", "did you mean 'azulay'"),
        ("azulay.toml", "the machine of the catalogue is called 'azulay'"),
        ("azuly", "did you mean 'azulay'"),
        ("nosuch/bench.toml", "No such file or directory\n"),
        ("nothing-alike", "trivet list tells all"),
    ],
)
def test_the_right_name_is_told(trivet: Any, bench: Any, name: str, answer: str) -> None:
    code, out, err = trivet("show", name)
    assert (code, out) == (2, "")
    assert err.startswith(f"trivet: {name}: ")
    assert answer in err


def complaint(bench: Any, *changes: tuple[str, str]) -> str:
    text = bench.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    bench.write_text(text)
    with pytest.raises(InputError) as told:
        load(str(bench))
    return str(told.value)


def test_all_faults_are_told(bench: Any) -> None:
    told = complaint(bench, ('"216 mm"', "216"), ("copies = 3", 'copies = "x"'), ('"19 mm"', '"19 kg"'))
    for path in ("elements.link.length: 216: ", 'leg.copies: "x" ', 'outer_diameter: "19 kg": '):
        assert path in told
    assert "more)" not in told
    assert told.count("; also ") == 2


def test_more_faults_than_fit_are_counted(bench: Any) -> None:
    told = complaint(bench, ("actuated = true", "\n".join(f"wrong_{k} = 1" for k in range(MOST + 3))))
    listed = told.count("wrong_")
    assert 1 < listed <= MOST
    assert told.endswith(f"(and {2 * (MOST + 3) - listed} more)")
    assert len(told) < LONGEST + 100

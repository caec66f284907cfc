"""Whatever stands in a machine file, reading it gives a machine or an InputError of one line, and never anything else."""

from __future__ import annotations

import copy
import datetime
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from documents import Document, same, validator, written
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from trivet.errors import InputError, one_line
from trivet.model import Machine, catalogue, document_of, load, parse, to_text

NASTY: list[Any] = [
    *(True, 0, -1, 3, 10**400, 16**9999, 0.5, -0.0, math.nan, math.inf, 1e308, 5e-324),
    *("", " ", "x", "z", "a.b", "a\nb", "\x00", "é", "x" * 5000, "steel", "link"),
    *("0", "216", "-216 mm", "0 mm", "-0 mm", "nan mm", "inf mm", "1e999 mm", "1e-999 mm", "1e300 km", "1 m^9^9^9"),
    *("200 deg", "1 N", "3 N/um", "(", "1 (", "1 /", "1 mm)", "1 [", "1 **", "1 \N{MICRO SIGN}m"),
    *([], [1], [[[]]], [0, 0, 0], [1e200] * 3, [5e-324] * 3, [10**400] * 3, ["1 mm"] * 3, ["1 mm", "2 mm"], ["2 deg", "1 deg"]),
    *({}, {"a": 1}, {"name": "x"}, {"type": "beam"}, [{}], [{"name": "x"}, {"type": []}]),
    *({"value": "1 mm"}, {"value": {}}, {"value": [{"value": 1}]}, {"value": 1, "source": 5}, {"value": 1, "": 1}),
    *(datetime.date(2020, 1, 1), datetime.time(1)),
]  # fmt: skip


def tables(node: Any, keys: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Keys of every table and list of a document."""
    if isinstance(node, (dict, list)):
        yield keys
        for key, value in node.items() if isinstance(node, dict) else enumerate(node):
            # All published numbers of a list are of one kind.
            if key not in ("published", "published_dynamic") or isinstance(node, list):
                yield from tables(value, (*keys, key))
            else:
                yield from tables(value[:1], (*keys, key))


def at(node: Any, keys: tuple[Any, ...]) -> Any:
    for key in keys:
        node = node[key]
    return node


def attempt(read: Callable[[], Machine]) -> Machine | str:
    """The machine, or the message by which it is refused."""
    try:
        return read()
    except InputError as error:
        return str(error)


def check(document: Document) -> None:
    """What is refused is refused in one line; what is read can be written, reads back the same, and is right by the schema."""
    machine = attempt(lambda: parse(document))
    if isinstance(machine, str):
        assert machine == one_line(machine)
        return
    assert same(machine, parse(document_of(machine)))
    assert validator().is_valid(document)


def places() -> Iterator[tuple[Document, Any, Any]]:
    """Every place of every catalogue document (document, table, key), once for places that are read by the same code."""
    seen = set()
    for name in catalogue():
        document = load_document(name)
        for keys in list(tables(document)):
            table = at(document, keys)
            kinds = (*(_kind(at(document, keys[:i])) or key for i, key in enumerate(keys)), _kind(table))
            for key in list(table) if isinstance(table, dict) else range(len(table)):
                if (*kinds, key) not in seen:
                    seen.add((*kinds, key))
                    yield document, table, key


def _kind(table: Any) -> str | None:
    return table.get("type", table.get("shape")) if isinstance(table, dict) else None


def test_any_value_anywhere() -> None:
    for document, table, key in places():
        kept = table[key]
        for value in NASTY:
            table[key] = copy.deepcopy(value)
            check(document)
        table[key] = kept


def test_any_key_left_out() -> None:
    for document, table, key in places():
        kept = copy.copy(table)
        del table[key]
        check(document)
        table.clear()
        table.update(kept) if isinstance(table, dict) else table.extend(kept)


def test_any_key_added() -> None:
    for document, table, _ in places():
        if isinstance(table, dict):
            for key in {"zzz", "value", "source", "name", "", "a.b", "a\nb"} - set(table):
                table[key] = "x"
                check(document)
                del table[key]


NAMING = ("name", "type", "shape", "format")


@pytest.mark.parametrize("name", catalogue())
def test_every_dimension_may_have_a_source(name: str) -> None:
    document = document_of(load(name))
    count = 0
    for keys in list(tables(document)):
        table = at(document, keys)
        if not isinstance(table, dict) or "value" in table:
            continue
        for key, value in table.items():
            is_table = isinstance(value, dict) or (isinstance(value, list) and isinstance(value[0], dict))
            if key not in NAMING and not is_table:
                table[key] = {"value": value, "source": f"page {count}", "status": "assumed"}
                count += 1
    machine = parse(document)
    assert len(machine.about.notes) >= count > 20
    assert document_of(machine) == document
    assert validator().is_valid(document)


def load_document(name: str) -> Document:
    """A machine with everything filled in, and sources beside numbers as in its file."""
    document = written(name)
    return document_of(load(name)) if "variant_of" in document else document


TEXT = to_text(load("azulay")).encode()


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, len(TEXT)), st.integers(0, 40), st.one_of(st.binary(max_size=12), st.text(max_size=6).map(str.encode)))
def test_any_bytes_anywhere(tmp_path: Path, start: int, length: int, inserted: bytes) -> None:
    path = tmp_path / "m.toml"
    path.write_bytes(TEXT[:start] + inserted + TEXT[start + length :])
    machine = attempt(lambda: load(path))
    if isinstance(machine, str):
        assert machine == one_line(machine)
    else:
        assert same(machine, parse(document_of(machine)))

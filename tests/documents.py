"""Documents of machines that several tests change, what they compare, and pages that they read back."""

from __future__ import annotations

import base64
import copy
import json
import math
import re
import tomllib
from collections.abc import Callable
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import jax
import jsonschema
import numpy as np
import pytest

from trivet.errors import InputError, one_line
from trivet.model import Machine, schema

Document = dict[str, Any]

ABSENT = object()


def written(name: str) -> Document:
    """A catalogue file as TOML gives it, variants not filled in."""
    return tomllib.loads(resources.files("trivet.catalog").joinpath(f"{name}.toml").read_text(encoding="utf-8"))


@cache
def validator() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(schema())


def same(a: Machine, b: Machine) -> bool:
    equal = jax.tree_util.tree_map(lambda x, y: x == y and math.copysign(1, x) == math.copysign(1, y), a, b)
    words = (a.about.notes, a.about.published, a.about.published_dynamic) == (
        b.about.notes,
        b.about.published,
        b.about.published_dynamic,
    )
    return jax.tree_util.tree_all(equal) and words


def with_change(document: Document, path: str, value: Any) -> Document:
    """A copy of a document with one value set or (ABSENT) left out; members of lists go by their names or numbers from 0."""
    changed = copy.deepcopy(document)
    *way, last = path.split("/")
    here: Any = changed
    for key in way:
        here = here[key] if isinstance(here, dict) else next(v for i, v in enumerate(here) if key in (v.get("name"), str(i)))
    if value is ABSENT:
        del here[last]
    else:
        here[last] = value
    return changed


def message_of(call: Callable[[], Any]) -> str:
    with pytest.raises(InputError) as caught:
        call()
    text = str(caught.value)
    assert text == one_line(text), "a message is one line of moderate length"
    assert caught.value.exit_code == 2
    return text


def traces(path: Path) -> list[dict[str, Any]]:
    """What a page of plotly draws, after a look that it needs no network."""
    text = path.read_text(encoding="utf-8")
    assert re.search(r"<(?:script|link)[^>]+(?:src|href)=", text) is None, "needs no network"
    (start,) = (match.end() for match in re.finditer(r"Plotly\.newPlot\(\s*\"[^\"]+\",\s*", text))
    found: list[dict[str, Any]] = json.JSONDecoder(parse_constant=pytest.fail).raw_decode(text, start)[0]
    return found


def numbers(packed: Any) -> np.ndarray:
    """What plotly has packed, or a list; NaN where there is a gap."""
    if isinstance(packed, dict):
        found = np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"]).astype(float)
        return found.reshape([int(size) for size in packed["shape"].split(",")]) if "shape" in packed else found
    return np.array([math.nan if value is None else value for value in packed], dtype=float)

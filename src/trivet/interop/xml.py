"""What the exports write in XML alike."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from typing import Any

from trivet.errors import InputError
from trivet.model.elements import Element


def numbers(values: Iterable[Any]) -> str:
    """Numbers as they are read again; no -0 and no .0."""
    return " ".join(repr(float(value) + 0.0).removesuffix(".0") for value in values)


def comment(text: str) -> ET.Element[Any]:
    """A comment; two hyphens, which names of chains may hold, would end it."""
    return ET.Comment(f" {re.sub('-(?=-)', '- ', text)} ")


def unknown_joint(name: str, joint: Element, form: str) -> InputError:
    """What is to be said of a joint for which an export has no counterpart."""
    kind = getattr(joint, "type", type(joint).__name__)
    return InputError(f"{name}: a joint of type '{kind}' has no counterpart in the {form} export; leave the machine out")

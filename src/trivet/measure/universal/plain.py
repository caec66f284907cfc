"""Numbers in the text of universal files, and how pyuff is asked for them."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from trivet.measure.universal.scan import Block

Fields = dict[str, Any]
"""A dataset as pyuff gives it."""

NUMBER = re.compile(r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|nan|inf(?:inity)?)", re.IGNORECASE)
INTEGER = re.compile(r"[-+]?\d+")
FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[-+ ]?\d)")
"""The letter of an exponent that pyuff does not know."""
UNREADABLE = "is not written as its type demands, and cannot be read"


def ask(
    block: Block,
    extract: Callable[..., Fields],
    text: str | bytes,
    complaint: str = UNREADABLE,
    record: int | None = None,
    **options: Any,
) -> Fields:
    """What pyuff makes of a dataset; it raises bare exceptions, without a place or a reason."""
    try:
        return extract(text, **options)
    except Exception:
        raise block.error(complaint, record) from None

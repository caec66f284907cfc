"""trivet schema."""

from __future__ import annotations

from trivet.cli import output


def run() -> None:
    """Print the JSON schema of machine files, with which editors complete and check them."""
    from trivet.model import schema

    output.print_json(schema())

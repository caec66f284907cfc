"""`python -m trivet`."""

from trivet.cli import program

program()

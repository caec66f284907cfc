"""The commands of `trivet measure`, a module per command: its function `run` takes the options, and its docstring is the help."""

COMMANDS: dict[str, str] = {"import": "importing", "fit": "fitting", "correlate": "correlating"}
"""Modules of this folder, by the names of the commands, in the order of the help."""

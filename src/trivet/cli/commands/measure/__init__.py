"""The commands of `trivet measure`, a module each: its function `run` takes the options, its docstring is the help."""

COMMANDS: dict[str, str] = {"import": "importing", "fit": "fitting", "correlate": "correlating", "update": "updating"}
"""Modules of this folder, by the names of the commands, in the order of the help."""

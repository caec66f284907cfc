"""The commands, a module per command: its function `run` takes the options, and its docstring is the help."""

NAMES = (
    "list", "show", "view", "pose", "map", "compare", "accuracy", "forward", "singularity", "tilt", "workspace", "plan",
    "modes", "frf", "lobes", "locks", "solids", "dynamics", "simulate", "sweep", "optimise", "sensitivity", "report",
    "reproduce", "export", "schema",
)  # fmt: skip
"""Commands in the order of the help; each is the module of its name."""

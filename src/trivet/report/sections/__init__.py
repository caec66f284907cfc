"""Sections of a report, a module per section: its function `section` takes a machine and gives a section."""

OWN = ("machine", "home", "reach", "singularities", "stiffness", "vibration", "dynamics", "file")
"""Of every machine, in their order."""
COMPARISON, MEASURED = "comparison", "measured"
SECTIONS = (*OWN, COMPARISON, MEASURED)

"""Sections of a report, a module per section: its function `section` takes a machine and gives a section."""

"""Modes of measured responses, with intervals."""

"""Measured frequency responses: files, modal fit, correlation with a machine, updating of its numbers."""

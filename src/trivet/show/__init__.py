"""Drawings, tables and figures of what the other folders compute."""

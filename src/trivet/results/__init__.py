"""Labelled results with units: NetCDF."""

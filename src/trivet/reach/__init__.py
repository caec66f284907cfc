"""Reach: how far a machine can go before a limit, a collision or a singularity stops it."""

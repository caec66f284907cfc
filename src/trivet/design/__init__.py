"""Studies over many designs of machines: sweeps, fronts of the best, and what their numbers are sensitive to.

A *design* is a row of values of the study's *variables*; a *quantity* is a number that is asked of every design.
"""

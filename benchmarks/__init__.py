"""Benchmarks, apart from the tests: warmed, paired with a peer in one run, stated as ratios.  `python -m benchmarks`."""

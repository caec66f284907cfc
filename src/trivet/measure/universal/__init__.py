"""Universal files: datasets 15, 55, 58, 151, 164, 2411, 2420."""

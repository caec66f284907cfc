"""The page: a machine that can be grabbed, on loopback, in the browser."""

"""Numbers of a machine corrected by what was measured, and what is told of them."""

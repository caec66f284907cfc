"""The paper from which the project started: its tables and figures, rebuilt, with the deviations beside them."""

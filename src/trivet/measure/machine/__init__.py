"""The machine that was measured: where points lie on it, its numbers, what it would answer there."""

"""Chains with inverse kinematics in closed form, one file per kind.

A kind has `matches(elements)`, `branches(elements)` (its choices out of SIDE and ELBOW) and `stand(leg, pose, signs)`, which
gives the `Posture`.
"""

SIDE, ELBOW = 0, 1
"""Columns of the signs of a working mode."""

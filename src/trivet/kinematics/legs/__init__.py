"""Planar legs, one file each: what they are made of, and their inverse kinematics in closed form.

A family has `HAS_ELBOW`, `matches(elements)` and `solve(elements, frame, end, elbow)`.  The plane is x-z of the chain's frame:
x away from the axis of the guide, z up.  `frame` is where the leg starts, `end` the platform joint; both have y = 0.
`solve` gives the coordinates, one per element, and the reach: below zero where the leg cannot close (m^2).
"""

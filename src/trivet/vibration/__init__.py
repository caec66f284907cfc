"""Vibration: beam finite elements, modes, exact dynamic stiffness, frequency responses."""

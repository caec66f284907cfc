"""What designers ask: one pose, a surface of poses, several machines side by side."""

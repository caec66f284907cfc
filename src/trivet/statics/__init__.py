"""Static stiffness: by the compliance of chains (fast, differentiable) and by matrix structural analysis (the paper's way)."""

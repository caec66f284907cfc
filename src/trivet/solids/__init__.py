"""Links and beams as solid bodies: geometry, meshes, elasticity, and their reduction to the motions of their ends."""

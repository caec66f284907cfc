"""Vectors, frames, poses, screws and families of poses: components known by name, batches left to JAX."""

"""Machine files that come with trivet, and the materials which files may name; nothing else."""

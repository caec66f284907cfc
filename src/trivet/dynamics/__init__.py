"""Rigid-body dynamics (paper section 2.2): chains and platform, equations of motion, what drives and joints must bear."""

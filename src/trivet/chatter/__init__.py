"""Chatter of milling: what a cut does, how the tool point gives way, and the depth of cut up to which both stay stable."""

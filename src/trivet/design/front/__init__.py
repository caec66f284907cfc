"""The best designs under several objectives: evolved, polished by slopes, told apart.  Nothing here knows a machine."""

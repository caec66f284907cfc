"""How measured responses stand in files: NetCDF and tables; any of them by its suffix."""

"""The panels of the page: controls that ask for another state, and what is told of the present one."""

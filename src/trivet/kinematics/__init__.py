"""Where the joints are: inverse kinematics, working modes, travel limits, Jacobians."""

"""Between planners and the base: the choice between sources of velocities, smoothing, and bumpers."""

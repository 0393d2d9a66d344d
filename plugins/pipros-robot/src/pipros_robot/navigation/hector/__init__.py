"""Maps without odometry, like hector_mapping."""

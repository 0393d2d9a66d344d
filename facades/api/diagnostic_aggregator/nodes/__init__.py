"""The programs of `rosrun diagnostic_aggregator …`."""

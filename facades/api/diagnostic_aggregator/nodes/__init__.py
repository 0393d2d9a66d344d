"""The programs that `rosrun diagnostic_aggregator …` runs."""

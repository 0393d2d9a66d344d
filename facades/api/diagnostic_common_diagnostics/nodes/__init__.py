"""The programs that `rosrun diagnostic_common_diagnostics …` runs."""

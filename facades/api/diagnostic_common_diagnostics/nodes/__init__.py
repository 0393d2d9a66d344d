"""The programs of `rosrun diagnostic_common_diagnostics …`."""

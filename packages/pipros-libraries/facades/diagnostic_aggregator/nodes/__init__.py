"""Executables of the diagnostic_aggregator package."""

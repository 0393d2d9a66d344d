"""Executables of the diagnostic_common_diagnostics package."""

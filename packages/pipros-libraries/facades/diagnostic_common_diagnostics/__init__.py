"""diagnostic_common_diagnostics: nodes that report their computer's state."""

"""diagnostic_common_diagnostics: nodes that report on their machine."""

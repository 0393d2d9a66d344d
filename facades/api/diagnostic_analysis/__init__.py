"""diagnostic_analysis: export of recorded diagnostics to CSV files."""

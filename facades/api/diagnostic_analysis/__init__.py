"""diagnostic_analysis: exports recorded diagnostics to CSV files."""

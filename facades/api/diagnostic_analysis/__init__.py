"""diagnostic_analysis: recorded diagnostics as CSV files."""

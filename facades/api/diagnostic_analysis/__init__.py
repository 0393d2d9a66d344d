"""diagnostic_analysis, which exports recorded diagnostics to CSV files."""

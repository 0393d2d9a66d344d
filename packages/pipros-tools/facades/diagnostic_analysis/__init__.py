"""diagnostic_analysis: exporter of recorded diagnostics to CSV files."""

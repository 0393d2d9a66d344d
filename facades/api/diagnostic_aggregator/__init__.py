"""diagnostic_aggregator: sorts what is reported on /diagnostics into a tree."""

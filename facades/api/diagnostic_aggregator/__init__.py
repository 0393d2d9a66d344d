"""diagnostic_aggregator, which arranges the statuses on /diagnostics in a tree."""

"""diagnostic_aggregator: arranges the statuses on /diagnostics in a tree."""

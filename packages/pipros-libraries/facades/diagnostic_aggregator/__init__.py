"""diagnostic_aggregator: nodes that arrange the statuses on /diagnostics in a tree."""

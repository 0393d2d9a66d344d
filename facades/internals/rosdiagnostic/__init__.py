"""rosdiagnostic: prints the statuses on /diagnostics_agg."""

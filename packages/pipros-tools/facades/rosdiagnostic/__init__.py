"""rosdiagnostic: print the statuses on /diagnostics_agg."""

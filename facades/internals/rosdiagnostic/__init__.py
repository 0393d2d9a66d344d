"""rosdiagnostic: prints what is reported on /diagnostics_agg."""

"""diagnostic_common_diagnostics: programs that report on the machine they run on."""

"""smclib: what state machines that SMC has generated stand on."""

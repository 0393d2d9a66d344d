"""One side of a bond: its state machine, timeouts and heartbeats."""

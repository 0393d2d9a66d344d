"""One side of a bond: its state machine, and its timeouts and heartbeats."""

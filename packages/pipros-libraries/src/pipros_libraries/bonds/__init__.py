"""State machine, timeouts and heartbeats of one side of a bond."""

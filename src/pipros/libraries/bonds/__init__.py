"""The state machine of one side of a bond."""

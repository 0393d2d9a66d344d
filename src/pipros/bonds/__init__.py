"""The life of a bond: the state machine of one side."""

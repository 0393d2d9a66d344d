"""A proxy that disturbs the connections between nodes, and a checker for the messages that arrive."""

"""A proxy that disturbs the connections between nodes, and a checker of the messages that arrive."""

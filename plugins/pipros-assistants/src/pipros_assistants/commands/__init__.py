"""The command `pipros mcp`."""

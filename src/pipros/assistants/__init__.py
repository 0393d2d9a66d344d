"""Tools for assistants: a server of the Model Context Protocol (MCP) for the running system and its bags."""

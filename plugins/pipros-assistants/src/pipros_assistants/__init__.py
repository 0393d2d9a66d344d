"""Tools for assistants: a Model Context Protocol (MCP) server for the running system and for bags."""

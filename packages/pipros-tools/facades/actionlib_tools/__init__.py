"""Drop-in replacement for Noetic's actionlib_tools: axclient, axserver, and messages from YAML."""

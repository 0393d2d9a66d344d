"""actionlib_tools, as Noetic has it, on pipros: axclient, axserver, and messages from YAML."""

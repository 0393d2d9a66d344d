"""topic_tools: programs that pass messages on, and the services of `topic_tools.srv`."""

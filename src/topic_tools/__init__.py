"""Drop-in replacement for Noetic's topic_tools: executables that republish messages."""

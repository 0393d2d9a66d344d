"""The node of the rosapi package. Its services describe the running system to rosbridge clients."""

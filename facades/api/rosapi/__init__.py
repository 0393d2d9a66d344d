"""The node of the package rosapi. Its services describe the running system to rosbridge clients."""

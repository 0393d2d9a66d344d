"""The node of the package rosapi, whose services describe the running system to clients of rosbridge."""

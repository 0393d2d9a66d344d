"""Frontier exploration: drive a robot to the borders of what its map shows, like explore_lite."""

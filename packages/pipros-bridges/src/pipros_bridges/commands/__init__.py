"""The commands that serve rosbridge and Foxglove, and list their clients."""

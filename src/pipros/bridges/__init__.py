"""Servers for browsers and other languages: what the rosbridge and Foxglove protocols share."""

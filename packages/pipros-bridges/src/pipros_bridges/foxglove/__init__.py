"""The Foxglove WebSocket protocol for ROS 1: raw messages with their definitions, parameters and services."""

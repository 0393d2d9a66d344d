"""The scene: its configuration, and the messages and clouds that it shows."""

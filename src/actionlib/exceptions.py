"""The exception of actionlib."""


class ActionException(Exception):
    """A type is no action."""

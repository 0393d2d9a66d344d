"""Exceptions of actionlib."""


class ActionException(Exception):
    """The given class is not an action class."""

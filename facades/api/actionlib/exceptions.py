"""Exceptions of actionlib."""


class ActionException(Exception):
    """A class is not the class of an action."""

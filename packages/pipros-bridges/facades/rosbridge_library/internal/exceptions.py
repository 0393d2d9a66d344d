"""Exceptions raised by rosbridge capabilities."""


class InvalidArgumentException(Exception):
    """An argument of an operation has an invalid value."""


class MissingArgumentException(Exception):
    """An operation lacks an argument."""

"""Exceptions that capabilities raise."""


class InvalidArgumentException(Exception):
    """An argument of an operation has a wrong value."""


class MissingArgumentException(Exception):
    """An operation lacks an argument."""

"""`rosmaster.exceptions`: the exception for internal errors of the master."""


class InternalException(Exception):
    """Internal error of the master, such as an invalid registration type."""

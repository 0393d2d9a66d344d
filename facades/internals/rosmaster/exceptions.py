"""`rosmaster.exceptions`."""


class InternalException(Exception):
    """Something went wrong inside the master. Nothing here raises it; old code catches it."""

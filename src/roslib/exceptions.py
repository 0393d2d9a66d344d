"""`roslib.exceptions`, for old scripts."""


class ROSLibException(Exception):
    """Base of errors of roslib. Nothing here raises it; old scripts catch it."""

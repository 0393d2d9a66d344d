"""`roslib.exceptions`, for old scripts."""


class ROSLibException(Exception):
    """Base of errors of roslib. pipros never raises it; old scripts catch it."""

"""`roslib.exceptions`, for legacy scripts."""


class ROSLibException(Exception):
    """Base class of roslib's errors. pipros never raises it directly; legacy scripts catch it."""

"""`genpy.rostime`: the classes of `pipros.msg.time`."""

from pipros.msg.time import Duration, Time, TVal

__all__ = ["Duration", "TVal", "Time"]

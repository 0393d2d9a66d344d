"""`genpy.rostime`: the classes of `pipros.msg.time`."""

from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg.time import Duration, Time, TVal

__all__ = ["Duration", "TVal", "Time"]

_star_names(__name__, "numbers")

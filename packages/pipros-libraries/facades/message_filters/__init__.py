"""Drop-in replacement for Noetic's message_filters: caching and synchronization of messages by timestamp."""

from message_filters.cache import Cache as Cache
from message_filters.chain import Chain as Chain
from message_filters.chain import PassThrough as PassThrough
from message_filters.sequencer import TimeSequencer as TimeSequencer
from message_filters.simple_filter import SimpleFilter as SimpleFilter
from message_filters.simple_filter import Subscriber as Subscriber
from message_filters.synchronizers import ApproximateTimeSynchronizer as ApproximateTimeSynchronizer
from message_filters.synchronizers import TimeSynchronizer as TimeSynchronizer
from pipros.basics.lazy_names import star_names as _star_names

_star_names(
    __name__,
    "itertools functools:reduce rospy threading",
    hidden="Chain PassThrough TimeSequencer cache chain sequencer simple_filter synchronizers",
)

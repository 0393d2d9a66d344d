"""topic_tools: programs that pass messages on, and the services of `topic_tools.srv`."""

from pipros.lazy_names import lazy_names as _lazy_names

# Most scripts that import the package want its services only, and no rospy.
__getattr__, __dir__ = _lazy_names(__name__, {"LazyTransport": "topic_tools.lazy_transport"})

__all__ = ["LazyTransport"]

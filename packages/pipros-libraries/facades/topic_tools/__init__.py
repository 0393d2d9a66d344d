"""Drop-in replacement for Noetic's topic_tools: executables that republish messages, and `LazyTransport`."""

import typing as _typing

import pipros.startup as _startup  # noqa: F401 # installs the import hook, in case pipros.pth did not
from pipros.basics.lazy_names import lazy_names as _lazy_names

# Most scripts that import this package need its services, but not rospy.
if _typing.TYPE_CHECKING:
    from topic_tools.lazy_transport import LazyTransport as LazyTransport
else:
    __getattr__, __dir__ = _lazy_names(__name__, {"LazyTransport": "topic_tools.lazy_transport"})

__all__ = ["LazyTransport"]

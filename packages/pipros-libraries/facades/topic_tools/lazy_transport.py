"""`LazyTransport`, the base class of nodes that subscribe only while their own topics have subscribers."""

from __future__ import annotations

from typing import Any

import rospy

_WARN_AFTER = rospy.Duration(5)


class LazyTransport(rospy.SubscribeListener):
    """Base class of nodes that subscribe only while their own topics have subscribers.

    `subscribe` is called when the first subscriber connects, and `unsubscribe` when the last one disconnects.
    Subclasses define both methods. If the parameter `~lazy` is false, `unsubscribe` is not called, and
    `_post_init` subscribes immediately. As in Noetic on Python 3, `_post_init` is not called automatically.
    """

    def __init__(self) -> None:
        super().__init__()
        self._publishers: list[rospy.Publisher[Any]] = []
        self._connection_status: bool | None = None  # None before the first call to `subscribe`
        rospy.Timer(_WARN_AFTER, self._warn_never_subscribed_cb, oneshot=True)

    def _post_init(self) -> None:
        if not rospy.get_param("~lazy", True):
            self.subscribe()
            self._connection_status = True

    def _warn_never_subscribed_cb(self, timer_event: object) -> None:  # noqa: ARG002 # passed by the timer
        if self._connection_status is None:
            rospy.logwarn(
                f"[{rospy.get_name()}] has not subscribed to anything yet, because it has no subscribers. "
                "Set '~lazy' to False to keep it subscribed."
            )

    def subscribe(self) -> None:
        """Subscribe to the input. Subclasses must override this method."""
        raise NotImplementedError("a subclass of LazyTransport must define subscribe()")

    def unsubscribe(self) -> None:
        """Unsubscribe from the input. Subclasses must override this method."""
        raise NotImplementedError("a subclass of LazyTransport must define unsubscribe()")

    def peer_subscribe(self, *args: object, **kwargs: object) -> None:  # noqa: ARG002
        """Subscribe to the input unless already subscribed.

        rospy calls this method for each new subscriber.
        """
        if not self._connection_status:
            self.subscribe()
            self._connection_status = True

    def peer_unsubscribe(self, *args: object, **kwargs: object) -> None:  # noqa: ARG002
        """Unsubscribe from the input once none of the output topics has a subscriber."""
        if not rospy.get_param("~lazy", True) or not self._connection_status:
            return
        if all(publisher.get_num_connections() == 0 for publisher in self._publishers):
            self.unsubscribe()
            self._connection_status = False

    def advertise(self, *args: Any, **kwargs: Any) -> rospy.Publisher[Any]:
        """Create a publisher. Takes the arguments of `rospy.Publisher` except `subscriber_listener`."""
        assert len(args) < 3 or args[2] is None  # noqa: S101 # genuine ROS raises AssertionError, too
        assert kwargs.get("subscriber_listener") is None  # noqa: S101
        publisher = rospy.Publisher(*args, **{**kwargs, "subscriber_listener": self})
        self._publishers.append(publisher)
        return publisher

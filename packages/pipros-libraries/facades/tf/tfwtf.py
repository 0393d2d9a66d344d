"""tf's roswtf plugin, which records /tf for one second and reports inconsistent transforms."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from tf2_msgs.msg import TFMessage

import rospy
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.transforms import diagnose
from pipros_libraries.transforms.diagnose import ReceivedTransform
from roswtf.rules import error_rule, warning_rule

_star_names(__name__, "math rosgraph tf")

_LISTEN_S = 1.0


def _recorded(ctx: Any) -> Sequence[ReceivedTransform]:
    """Return the transforms that `roswtf_plugin_online` recorded."""
    return getattr(ctx, "received_transforms", ())


def no_msgs(ctx: Any) -> bool:
    return not _recorded(ctx)


_Check = Callable[[Sequence[ReceivedTransform]], list[str]]


def _rule(check: _Check) -> Callable[[Any], list[str]]:
    return lambda ctx: check(_recorded(ctx))


rostime_delta = _rule(diagnose.of_other_times)
reparenting = _rule(diagnose.reparented)
cycle_detection = _rule(diagnose.loops)
multiple_authority = _rule(diagnose.of_several_senders)
not_normalized = _rule(diagnose.not_normalized)

Rule = tuple[Callable[[Any], Any], str]

tf_warnings: list[Rule] = [
    (no_msgs, "No tf messages"),
    (rostime_delta, "Received out-of-date/future transforms:"),
    (not_normalized, "Received non-normalized rotation in transforms:"),
]
tf_errors: list[Rule] = [
    (reparenting, "TF re-parenting contention:"),
    (cycle_detection, "TF cycle detection::"),
    (multiple_authority, "TF multiple authority contention:"),
]


def is_tf_active() -> bool:
    """Return True if /tf has a publisher, or False if it has none or the master cannot be reached."""
    try:
        return any(topic == "/tf" for topic, _ in rospy.get_published_topics())
    except OSError:
        return False


def roswtf_plugin_online(ctx: Any) -> None:
    """Apply the rules if /tf has a publisher. Blocks for one second. Requires an initialized node."""
    if not is_tf_active():
        return
    print("running tf checks, this will take a second...", flush=True)
    ctx.received_transforms = _listen()
    print("... tf checks complete")
    for function, text in tf_warnings:
        warning_rule((function, text), function(ctx), ctx)
    for function, text in tf_errors:
        error_rule((function, text), function(ctx), ctx)


def _listen() -> list[ReceivedTransform]:
    found: list[ReceivedTransform] = []

    def on_message(message: Any) -> None:
        found.extend(diagnose.received_in(message, rospy.get_rostime()))

    subscriber = rospy.Subscriber("/tf", TFMessage, on_message)
    time.sleep(_LISTEN_S)
    subscriber.unregister()
    return found

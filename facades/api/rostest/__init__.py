"""The names of genuine `rostest` that test scripts use; the work is done in `pipros.testing`."""

from __future__ import annotations

import functools
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from pipros.basics.lazy_names import star_names as _star_names
from pipros.testing import graph, script_runner
from pipros.testing.result_paths import XML_OUTPUT_FLAG

__all__ = [
    "XML_OUTPUT_FLAG",
    "deprecated",
    "get_master",
    "is_publisher",
    "is_subscriber",
    "rosrun",
    "rostestmain",
    "run",
    "unitrun",
]

_star_names(__name__, "importlib:reload rosgraph rosunit sys warnings")

_TOOL = "script"


def rosrun(
    package: str, test_name: str, test: script_runner.Tests, sysargs: Sequence[str] | None = None
) -> None:
    """Runs tests of nodes and topics; `test_name` names the result file and starts nothing.

    The node that the tests made is shut down afterwards, and the process ends with 1 when they did not pass.
    """
    passed = script_runner.run_program(package, test_name, test, sys.argv if sysargs is None else sysargs)
    # Late: a test program that never asked for a node does not need to load what makes one.
    import rospy

    rospy.signal_shutdown("test complete")
    script_runner.exit_unless(passed)


run = rosrun


def deprecated(func: Callable[..., Any]) -> Callable[..., Any]:
    """The function, with a warning at each call that it is deprecated."""

    @functools.wraps(func)
    def call(*args: Any, **kwargs: Any) -> Any:
        warnings.warn(
            f"Call to deprecated function {func.__name__}.", category=DeprecationWarning, stacklevel=2
        )
        return func(*args, **kwargs)

    return call


def rostestmain() -> None:
    """The command `rostest`, with the command line of this process. Ends the process when it fails."""
    from rostest.rostest_main import rostestmain as main

    main()


def unitrun(*args: Any, **kwargs: Any) -> None:
    """Deprecated in genuine ROS too: use `rosunit.unitrun`."""
    import rosunit

    warnings.warn("rostest.unitrun is deprecated: use rosunit.unitrun", DeprecationWarning, stacklevel=2)
    rosunit.unitrun(*args, **kwargs)


def is_subscriber(topic: str, subscriber_id: str) -> bool:
    """True when the master knows the node `subscriber_id` as a subscriber of `topic`."""
    return graph.is_subscriber(topic, subscriber_id, _TOOL)


def is_publisher(topic: str, publisher_id: str) -> bool:
    """True when the master knows the node `publisher_id` as a publisher of `topic`."""
    return graph.is_publisher(topic, publisher_id, _TOOL)


def get_master() -> Any:
    """An XML-RPC proxy of the master, for tests that ask it themselves."""
    from xmlrpc.client import ServerProxy

    from pipros.basics.env import Environment

    return ServerProxy(Environment.from_os().master_uri)

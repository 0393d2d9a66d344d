"""Drop-in replacement for Noetic's rostest; a facade of `pipros_tools.testing`."""

from __future__ import annotations

import functools
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.testing import graph, script_runner
from pipros_tools.testing.result_paths import XML_OUTPUT_FLAG

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
    """Run tests of nodes and topics. `test_name` determines the name of the result file.

    Afterwards, shut down the node created by the tests, and exit with code 1 if the tests did not pass.
    """
    passed = script_runner.run_program(package, test_name, test, sys.argv if sysargs is None else sysargs)
    # Not imported at the top, because test programs without a node do not need rospy.
    import rospy

    rospy.signal_shutdown("test complete")
    script_runner.exit_unless(passed)


run = rosrun


def deprecated(func: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a function so that each call issues a DeprecationWarning."""

    @functools.wraps(func)
    def call(*args: Any, **kwargs: Any) -> Any:
        warnings.warn(
            f"Call to deprecated function {func.__name__}.", category=DeprecationWarning, stacklevel=2
        )
        return func(*args, **kwargs)

    return call


def rostestmain() -> None:
    """Run the command `rostest` with the command line of this process. Exit the process on failure."""
    from rostest.rostest_main import rostestmain as main

    main()


def unitrun(*args: Any, **kwargs: Any) -> None:
    """Same as `rosunit.unitrun`. Deprecated, as in genuine ROS."""
    import rosunit

    warnings.warn("rostest.unitrun is deprecated: use rosunit.unitrun", DeprecationWarning, stacklevel=2)
    rosunit.unitrun(*args, **kwargs)


def is_subscriber(topic: str, subscriber_id: str) -> bool:
    """Return True if the node `subscriber_id` is registered as a subscriber of `topic`."""
    return graph.is_subscriber(topic, subscriber_id, _TOOL)


def is_publisher(topic: str, publisher_id: str) -> bool:
    """Return True if the node `publisher_id` is registered as a publisher of `topic`."""
    return graph.is_publisher(topic, publisher_id, _TOOL)


def get_master() -> Any:
    """Return an XML-RPC proxy for the master."""
    from pipros.basics.env import Environment
    from pipros.net.server_proxy import server_proxy

    return server_proxy(Environment.from_os().master_uri)

"""ros_comm#253: `get_param(search_param("x"), default)` did not return the default if nothing was found."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from pipros.basics.errors import InvalidName
from pipros.master.master import Master
from tests.support.nodes import MakeNode
from tests.support.processes import Processes

SCRIPT = """
import rospy
from std_srvs.srv import Empty

def attempt(action, *arguments):
    try:
        print(action.__name__, action(*arguments))
    except Exception as error:
        kind = next(kind for kind in (KeyError, ValueError, Exception) if isinstance(error, kind))
        print(action.__name__, kind.__name__, str(error))

def examine():
    nothing = rospy.search_param("nothing")
    for action in (rospy.get_param, rospy.get_param_cached):
        attempt(action, nothing, "the default")
        attempt(action, nothing)
    for action in (rospy.has_param, rospy.delete_param, rospy.search_param):
        attempt(action, nothing)
    attempt(rospy.set_param, nothing, 1)
    attempt(rospy.ServiceProxy, nothing, Empty)
    attempt(rospy.wait_for_service, nothing, 1)
    for name in (nothing, ""):
        attempt(rospy.Service, name, Empty, print)
    print(rospy.get_published_topics(nothing) == rospy.get_published_topics())

rospy.set_param("/something", 1)
examine()
rospy.init_node("node")
examine()
"""

EXPECTED = [
    "",
    "get_param the default",
    "get_param KeyError 'parameter: a name must be a string, got None'",
    "get_param_cached the default",
    "get_param_cached KeyError 'parameter: a name must be a string, got None'",
    "has_param False",
    "delete_param KeyError 'parameter: a name must be a string, got None'",
    "search_param ValueError a name must be a string, got None",
    "set_param ValueError a name must be a string, got None",
    "ServiceProxy ValueError a name must be a string, got None",
    "wait_for_service ValueError a name must be a string, got None",
    "Service ValueError service name is not a non-empty string",
    "Service ValueError service name is not a non-empty string",
    "True",
    "",
][1:-1]


def test_none_as_a_name_means_the_default_or_an_error_that_names_it(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    script = tmp_path / "node.py"
    script.write_text(SCRIPT)
    node = processes.run(sys.executable, str(script), environment={"ROS_MASTER_URI": master.uri})
    assert node.stdout == EXPECTED * 2, node.output


def test_a_node_of_the_library_refuses_names_that_are_not_strings(make_node: MakeNode) -> None:
    node = make_node("node")
    for name in (None, 5, b"x"):
        with pytest.raises(InvalidName, match="a name must be a string, got "):
            node.params.get(name)  # type: ignore[arg-type]

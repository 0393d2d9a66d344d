"""Every public name of genuine ROS's Python packages exists, with the same arguments.

A table in `docs/internals/differences.md` lists the only allowed differences. Its names are patterns of full
names, `module.Name` or `module.Class.member`, in which `*` matches any characters.
"""

import difflib
import fnmatch
import json
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.support import documents
from tests.support.environments import genuine_environment, make_tool_folder, pipros_environment
from tests.support.once import make_once, shared_folder
from tests.support.same_results import printed

PACKAGES = [
    *("actionlib", "actionlib_tools", "angles", "bondpy", "camera_calibration_parsers", "catkin"),
    *("cv_bridge", "diagnostic_analysis", "diagnostic_updater", "dynamic_reconfigure", "genmsg", "genpy"),
    *("image_geometry", "interactive_markers", "laser_geometry", "message_filters", "rosbag", "rosclean"),
    *("rosgraph", "roslaunch", "roslib", "rosmaster", "rosmsg", "rosnode", "rosparam", "rospy"),
    *("rosservice", "rostest", "rostopic", "rosunit", "roswtf", "smclib", "tf", "tf2_geometry_msgs"),
    *("tf2_py", "tf2_ros", "tf2_sensor_msgs", "tf_conversions"),
]
"""All of them but `tf2_kdl`, which needs PyKDL, and what runs a node when it is imported."""

TABLE = documents.text_of("internals/differences.md").partition("| names | difference | explanation |\n")[2]
ROWS = [row.split(" | ")[:2] for row in TABLE.partition("\n\n")[0].splitlines()[1:]]
DIFFERENCES = {name: kind for names, kind in ROWS for name in re.findall(r"`(.+?)`", names)}

BROKEN_IN_GENUINE = {"rospy.impl.udpros"}
"""Modules of genuine ROS that cannot be imported there, either."""

PRIVATE_NAMES = {
    "rosbag": ["Bag._clear_index", "Bag._write_connection_record"], "rosbag.bag": ["_ConnectionInfo"],
    "rosmsg": ["_get_package_paths", "_list_types"], "rospy": ["Rate._remaining"],
    "rospy.client": ["_init_node_args", "_unspecified"],
    "rospy.core": [
        *("_add_shutdown_thread", "_client_ready", "_client_shutdown_hooks", "_in_shutdown", "_log_filename"),
        *("_logging_identical", "_logging_once", "_logging_throttle", "_preshutdown_hooks", "_rospy_logger"),
        *("_shutdown_flag", "_shutdown_hooks", "_uri"),
    ],
    "rospy.impl.registration": ["_topic_manager", "_service_manager"],
    "rospy.names": ["_caller_id", "_caller_namespace", "_mappings", "_resolved_mappings", "_set_caller_id"],
    "rospy.rostime": ["_rostime_initialized", "_set_rostime"],
    "rospy.topics": ["_PublisherImpl", "_SubscriberImpl.receive_callback", "_TopicImpl", "_TopicManager"],
}  # fmt: skip
"""Private names that published packages use all the same."""

SCRIPTS = {
    "examine_api_catkin.py": 19, "examine_api_definitions.py": 500, "examine_api_nodes.py": 400,
    "examine_api_parts.py": 110, "examine_api_roslib.py": 150, "examine_api_tools.py": 100,
}  # fmt: skip
"""Programs that call functions with good and bad arguments: how many calls there are at least."""

Described = Mapping[str, Any]
Parameter = tuple[str, str, bool, object]


@pytest.fixture(scope="session")
def both(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> tuple[Described, Described]:
    """The names of genuine ROS, and those of pipros, by module."""
    folder = shared_folder(tmp_path_factory, worker_id) / "api"
    genuine, ours = dumped_once(folder, "dump_python_api.py", *PACKAGES)
    assert set(genuine["failed"]) <= BROKEN_IN_GENUINE, genuine["failed"]
    assert not ours["failed"], ours["failed"]
    return genuine["modules"], ours["modules"]


def dumped_once(folder: Path, program: str, *words: str) -> list[Any]:
    """Return what a program prints with genuine ROS and with pipros; it runs once for all workers."""
    path = str(Path(__file__).parent / "programs" / program)
    files = [folder / "genuine.json", folder / "ours.json"]

    def make() -> None:
        for file, (python, environment) in zip(files, interpreters(folder), strict=True):
            file.write_text(printed(python, "-W", "ignore", path, *words, environment=environment))

    make_once(folder, make)
    return [json.loads(file.read_bytes()) for file in files]


def interpreters(home: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield those of genuine ROS and of pipros, with their environments."""
    uri = "http://127.0.0.1:1"
    yield "/usr/bin/python3", genuine_environment(home, uri)
    yield "python3", pipros_environment(home, uri, make_tool_folder(home / "tools"))


@cache
def listed(name: str) -> str | None:
    """Return the kind of difference of a name that the table covers."""
    return next((kind for each, kind in DIFFERENCES.items() if fnmatch.fnmatchcase(name, each)), None)


def differences(genuine: Described, ours: Described) -> Iterator[tuple[str, str]]:
    """Return missing names and different signatures as `(full name, difference)`."""
    for module, names in genuine.items():
        for name, there in names.items():
            here = ours.get(module, {}).get(name)
            if there.get("foreign"):
                continue
            if here is None:
                yield f"{module}.{name}", "missing"
            else:
                yield from differences_of(f"{module}.{name}", there, here)


def differences_of(name: str, there: Described, here: Described) -> Iterator[tuple[str, str]]:
    if there["kind"] != here["kind"]:
        yield name, f"is a {here['kind']}, not a {there['kind']}"
    elif "value" in there and there["value"] != here.get("value"):
        yield name, f"is {here.get('value')!r}, not {there['value']!r}"
    elif "parameters" in there and not takes(here.get("parameters"), there["parameters"]):
        yield name, f"takes {shown(here.get('parameters'))}, not {shown(there['parameters'])}"
    if there["kind"] != "class" or "members" not in here:
        return
    if {"Exception", "Thread"} & set(there["bases"]) and not set(there["bases"]) <= set(here["bases"]):
        yield name, f"derives from {here['bases']}, not {there['bases']}"
    for member, what in there["members"].items():
        if what["kind"] == "inherited":
            continue
        own = here["members"].get(member)
        if own is None:
            yield f"{name}.{member}", "missing"
        elif what["kind"] == "method" and not takes(own.get("parameters"), what["parameters"]):
            yield f"{name}.{member}", f"takes {shown(own.get('parameters'))}, not {shown(what['parameters'])}"


def takes(here: list[Parameter] | None, there: list[Parameter] | None) -> bool:
    """Return True if the function accepts every argument that the genuine one accepts."""
    if there is None:
        return True
    if here is None:
        return False
    if here[:1] and here[0][0] == "self" and (not there or there[0][0] != "self"):
        here = here[1:]  # a method that genuine ROS creates with a decorator
    for place, (name, kind, has_default, default) in enumerate(there):
        if kind.startswith("VAR_"):
            if not any(parameter[1] == kind for parameter in here):
                return False
            continue
        found = next((parameter for parameter in here if parameter[0] == name), None)
        if found is None or (kind != "KEYWORD_ONLY" and here.index(found) != place):
            return False
        if found[1] == "POSITIONAL_ONLY" or (has_default and (not found[2] or found[3] != default)):
            return False
    names = {parameter[0] for parameter in there}
    return all(parameter[0] in names or parameter[2] or parameter[1].startswith("VAR_") for parameter in here)


def shown(parameters: list[Parameter] | None) -> str:
    if parameters is None:
        return "(?)"
    texts = [f"{name}={default!r}" if has_default else name for name, _, has_default, default in parameters]
    return "(" + ", ".join(texts) + ")"


def test_every_public_name_of_genuine_ros_exists_with_its_arguments(both) -> None:
    wrong = []
    for name, what in differences(*both):
        known = listed(name) or listed(name.rpartition(".")[0])
        if known is None or (known == "can only be imported" and what == "missing" and listed(name)):
            wrong.append(f"{name}: {what}")
    assert not wrong, "\n".join(wrong)


def test_every_listed_difference_exists(both: tuple[Described, Described]) -> None:
    different = [name for name, _ in differences(*both)]
    different += [name.rpartition(".")[0] for name in different]
    different += both[0].keys() - both[1].keys()
    named = [f"{module}.{name}" for module, names in both[0].items() for name in names]
    found = {"can only be imported": named, "does not exist": different, "differs": different}
    assert not [each for each, kind in DIFFERENCES.items() if not fnmatch.filter(found[kind], each)]


def test_nearly_all_names_are_the_same(both: tuple[Described, Described]) -> None:
    genuine, _ = both
    names = {f"{module}.{name}" for module, found in genuine.items() for name in found}
    missing = {name for name, what in differences(*both) if what == "missing"} & names
    assert len(names) > 2800
    # Most of them are in modules of genuine's processes that are left out as a whole.
    assert len(missing) < len(names) / 5


@pytest.mark.parametrize(("script", "outcomes"), SCRIPTS.items(), ids=list(SCRIPTS))
def test_functions_with_plain_arguments_return_the_same_as_in_genuine_ros(script, outcomes, tmp_path) -> None:
    genuine, ours = (outcomes_of(script, *each) for each in interpreters(tmp_path))
    assert len(genuine) >= outcomes
    different = list(difflib.unified_diff(genuine, ours, "genuine", "pipros", n=0, lineterm=""))
    assert not different, "\n".join(different)


def outcomes_of(script: str, python: str, environment: dict[str, str]) -> list[str]:
    """Return the output of the program, one call per line, without addresses of objects."""
    program = str(Path(__file__).parent / "programs" / script)
    variables = {**environment, "ROS_NAMESPACE": "/nsp", "ROS_ROOT": "/usr/share/ros"}
    said = printed(python, program, environment=variables).splitlines()
    lines = (line for line in said if line.startswith("@@"))
    # Errors in definitions name file, line and column in pipros.
    plain = (re.sub(r'\["InvalidMsgSpec", .*', "InvalidMsgSpec", line) for line in lines)
    return [re.sub(r"0x[0-9a-f]+", "…", line) for line in plain]


USED_WITHOUT_IMPORT = (
    *("xml.etree.ElementTree.parse", "xml.parsers.expat.ParserCreate", "importlib.util.find_spec"),
    *("os.path.join", "rosgraph.names.ns_join", "rosgraph.xmlrpc.XmlRpcNode"),
    *("rosgraph.roslogging.configure_logging", "genpy.message.fill_message_args", "genpy.rostime.Time"),
)
INNER = ["masterslave", "paramserver", "registration", "rosout", "tcpros", "tcpros_base", "validators"]

IMPORTS = {
    "private names that published packages use": "\n".join(
        f"import operator, {module}\noperator.attrgetter(*{names})({module})"
        for module, names in PRIVATE_NAMES.items()
    ),
    "inner modules of rospy": f"""
import rospy
print([getattr(rospy.impl, name).__name__ for name in {INNER}])""",
    "modules that those of catkin import": """
import catkin, catkin.find_in_workspaces
print(catkin.workspace.__name__)
catkin.workspace.get_workspaces()""",
    # like gazebo_ros, whose scripts use `xml.etree.ElementTree` after `import xml`
    "modules that rospy imports": f"""
import functools, importlib, rospy
for name in {USED_WITHOUT_IMPORT}:
    first, *rest = name.split('.')
    functools.reduce(getattr, rest, importlib.import_module(first))
import xml
assert not hasattr(xml, 'nothing')""",
}


@pytest.mark.parametrize("program", IMPORTS.values(), ids=list(IMPORTS))
def test_imports_give_what_scripts_use(program: str, tmp_path: Path) -> None:
    genuine, ours = (
        printed(python, "-c", program, environment=environment)
        for python, environment in interpreters(tmp_path)
    )
    assert ours == genuine

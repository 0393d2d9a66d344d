"""Call functions of roslib with valid and invalid arguments; see `examine_api_nodes.py`."""

import os
import tempfile
import warnings

from examination import begin, examine

import roslib

warnings.simplefilter("ignore")

PLAIN = (str, int, float, bytes, list, dict, tuple, type(None))
TYPES = ["int32", "int32[]", "int32[3]", "std_msgs/String", "Header", "String", "", "a b", "x[[", "x[-1]"]
TYPES += ["std_msgs/String[]", "roslib/Header", "std_msgs/Header", "time"]


def call(label, function, *args, **kwds):
    shown = [arg for arg in args if isinstance(arg, PLAIN)]
    examine(f"{label}{shown}{kwds or ''}", lambda: function(*args, **kwds))


def examine_msgs():
    import roslib.msgs

    msgs = roslib.msgs
    begin("roslib.msgs")
    names = "base_msg_type is_builtin is_header_type is_valid_constant_type is_valid_msg_type parse_type"
    for name in [*names.split(), "is_valid_msg_field_name"]:
        for kind in TYPES:
            call(name, getattr(msgs, name), kind)
    for kind in TYPES:
        call("resolve_type", msgs.resolve_type, kind, "pkg")


def examine_packages():
    import roslib.msgs
    import roslib.packages
    import roslib.resources

    begin("roslib packages")
    os.environ["ROS_PACKAGE_PATH"] = os.getcwd()
    for name, text in (
        (
            "here/package.xml",
            "<package><name>here</name><version>1.0.0</version><description>d</description>"
            '<maintainer email="me@example.org">me</maintainer><license>l</license></package>',
        ),
        ("here/msg/Outer.msg", "Inner[] inner\nint32 X=1 # one\ntime t\n"),
        ("here/msg/Inner.msg", "string s\n"),
        ("here/srv/Ask.srv", "Inner i\n---\nbool ok\n"),
        ("here/srv/readme.txt", "text"),
    ):
        os.makedirs(os.path.dirname(name), exist_ok=True)
        with open(name, "w") as file:
            file.write(text)
    call("list", lambda: sorted(roslib.msgs.list_msg_types("here", False)))

    def keep(path):
        return path.endswith(".srv")

    call("files", lambda: sorted(roslib.resources.list_package_resources("here", False, "srv", keep)))
    call("files", roslib.resources.list_package_resources_by_dir, "here", False, "none")
    call("get_pkg_subdir", lambda: os.path.basename(roslib.packages.get_pkg_subdir("here", "made")))


def raised(function):
    try:
        return function()
    except Exception as error:
        return type(error).__name__


def examine_names():
    import roslib.names as names

    begin("roslib.names")
    for name in ("a", "/a", "a/b", "~a", "/a//b/", "a b"):
        for function in (
            *(names.resource_name_base, names.resource_name_package, names.package_resource_name),
            *(names.is_legal_resource_name, names.is_legal_resource_base_name, names.canonicalize_name),
            *(names.namespace, names.is_global, names.is_private),
        ):
            call(function.__name__, function, name)
        call("ns_join", names.ns_join, "/ns", name)
        call("resolve_name", names.resolve_name, name, "/ns/me")
        call("resolve_name", names.resolve_name, name, "/ns/me", {"/ns/a": "/moved"})
    examine("constants", lambda: (names.ANYTYPE, names.SEP, names.REMAP, names.GLOBALNS, names.PRIV_NAME))
    begin("roslib.launcher")
    for package in ("std_msgs", "no_such_package"):
        examine(f"load_manifest {package}", lambda: raised(lambda: roslib.load_manifest(package)))
    examine("the same", lambda: roslib.load_manifest is roslib.launcher.load_manifest)
    for answer in (True, False):
        examine("interactive", lambda: (roslib.set_interactive(answer), roslib.is_interactive()))


def examine_environment():
    import roslib.rosenv

    begin("roslib.rosenv")
    for variables in (
        {}, {"ROS_HOME": "/h"}, {"ROS_ROOT": "/r", "ROS_PACKAGE_PATH": "/p", "ROS_MASTER_URI": "m"},
    ):  # fmt: skip
        for name in ("get_ros_home", "get_log_dir", "get_test_results_dir", "get_ros_package_path"):
            examine(f"{name} {variables}", lambda: getattr(roslib.rosenv, name)(env=variables))
        for needed in (True, False):
            for name in ("get_ros_root", "get_ros_package_path", "get_master_uri"):
                examine(
                    f"{name} {needed}",
                    lambda: raised(lambda: getattr(roslib.rosenv, name)(needed, variables)),
                )


examine_names()
examine_msgs()
examine_environment()
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    examine_packages()
    os.chdir("/")

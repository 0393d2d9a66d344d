"""Modules of roslib and roslaunch that legacy programs import, with the results of genuine ROS."""

from pathlib import Path

import pytest

import roslaunch
import roslaunch.arg_dump
import roslaunch.depends
import roslaunch.param_dump
import roslib.gentools
import roslib.msgs
import roslib.srvs

MANIFEST = """<package format="2"><name>my_pkg</name><version>1.0.0</version><description>x</description>
<maintainer email="me@example.com">me</maintainer><license>BSD</license>
<exec_depend>std_msgs</exec_depend><test_depend>roscpp</test_depend></package>"""
OUTER = """<launch><arg name="req" doc="needed"/><arg name="opt" default="3" doc="opt doc"/>
<arg name="fix" value="7"/><param name="p" value="$(arg opt)"/>
<node pkg="rospy" type="talker.py" name="n"/><include file="$(find my_pkg)/inner.launch"/></launch>"""
INNER = """<launch><node pkg="roscpp" type="x" name="m"/><param name="/q/z" type="double" value="3"/>
<rosparam>{a: 1, b: [1, 2]}</rosparam></launch>"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "my_pkg"
    folder.mkdir()
    files = {"package.xml": MANIFEST, "outer.launch": OUTER, "inner.launch": INNER, "bad.launch": "<launch>"}
    for name, text in files.items():
        (folder / name).write_text(text)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    return folder


def test_services_are_read_as_by_roslib() -> None:
    assert roslib.srvs.list_srv_types("std_srvs", False) == ["Empty", "SetBool", "Trigger"]
    file = roslib.srvs.srv_file("std_srvs", "SetBool")
    name, spec = roslib.srvs.load_from_file(file, "std_srvs")
    assert (name, spec.full_name, spec.short_name, spec.package) == (
        "std_srvs/SetBool", "std_srvs/SetBool", "SetBool", "std_srvs",
    )  # fmt: skip
    assert (spec.request.names, spec.response.types) == (["data"], ["bool", "string"])
    assert roslib.srvs.load_from_file(file)[0] == "SetBool"
    without_response = roslib.srvs.load_from_string("Point[3] p\n", "geometry_msgs")
    assert (without_response.request.types, without_response.response.types) == (
        ["geometry_msgs/Point[3]"], [],
    )  # fmt: skip
    specs, failed = roslib.srvs.get_pkg_srv_specs("std_srvs")
    assert ([name for name, _ in specs], failed) == (
        ["std_srvs/Empty", "std_srvs/SetBool", "std_srvs/Trigger"], [],
    )  # fmt: skip
    with pytest.raises(roslib.msgs.MsgSpecException):
        roslib.srvs.load_from_string("int32\n---\n")


def test_dependencies_and_sums_are_those_of_roslib() -> None:
    file = roslib.msgs.resource_file("geometry_msgs", "msg", "PoseStamped.msg")
    found = roslib.gentools.get_file_dependencies(file)
    assert found["deps"] == [
        "std_msgs/Header", "geometry_msgs/Pose", "geometry_msgs/Point", "geometry_msgs/Quaternion",
    ]  # fmt: skip
    assert sorted(found["files"]) == sorted(found["uniquedeps"])
    assert roslib.gentools.compute_md5(found) == "d3812c3cbc69362b77dc0b19b345f8f5"
    assert roslib.gentools.compute_md5_text(found, found["spec"]) == (
        "2176decaecbce78abc3b96ef049fabed header\ne45d45a5a1ce597b249e23fb30fc871f pose"
    )
    assert f"\n{'=' * 80}\nMSG: geometry_msgs/Pose\n" in roslib.gentools.compute_full_text(found)
    service = roslib.gentools.get_file_dependencies(roslib.srvs.srv_file("std_srvs", "SetBool"))
    assert roslib.gentools.compute_md5(service) == "09fb03525b03e7ea1fd3992bafd87e16"
    with pytest.raises(Exception, match="does not appear to be a message or service"):
        roslib.gentools.get_file_dependencies("/x/y.foo")


def test_arguments_of_launch_files_are_listed(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(package / "outer.launch")
    assert roslaunch.arg_dump.get_args([file]) == {"req": ("needed", None), "opt": ("opt doc", "3")}
    roslaunch.arg_dump.dump_args([file])
    assert capsys.readouterr().out == (
        'Required Arguments:\n  req: needed\nOptional Arguments:\n  opt (default "3"): opt doc\n'
    )
    with pytest.raises(roslaunch.RLException):
        roslaunch.arg_dump.get_args([str(package / "none.launch")])


def test_an_argument_without_doc_differs_from_one_with_an_empty_doc(tmp_path: Path) -> None:
    file = tmp_path / "args.launch"
    file.write_text('<launch><arg name="a" default="d"/><arg name="b" doc=""/></launch>')

    assert roslaunch.arg_dump.get_args([str(file)]) == {"a": (None, "d"), "b": ("", None)}


def test_parameters_of_launch_files_are_printed(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.param_dump.dump_params([str(package / "inner.launch")]) is True
    assert capsys.readouterr().out == "/a: 1\n/b:\n- 1\n- 2\n/q/z: 3.0\n\n"
    assert roslaunch.param_dump.dump_params([str(package / "bad.launch")]) is False
    assert capsys.readouterr().err.startswith(f"Unable to load file {package / 'bad.launch'}: ")


def test_packages_that_launch_files_need_are_found(package: Path) -> None:
    outer, inner = str(package / "outer.launch"), str(package / "inner.launch")
    owner, files, missing = roslaunch.depends.roslaunch_deps([outer], ignore_unset_args=True)
    assert owner == "my_pkg"
    assert files == {
        outer: roslaunch.depends.RoslaunchDeps([("rospy", "talker.py")], [inner], ["rospy"]),
        inner: roslaunch.depends.RoslaunchDeps([("roscpp", "x")], [], ["roscpp"]),
    }
    assert missing == {"my_pkg": {"rospy", "roscpp"}}
    assert roslaunch.depends.roslaunch_deps([inner], use_test_depends=True)[2] == {"my_pkg": set()}
    with pytest.raises(roslaunch.depends.RoslaunchDepsException, match="Cannot load roslaunch"):
        roslaunch.depends.roslaunch_deps([str(package / "bad.launch")])

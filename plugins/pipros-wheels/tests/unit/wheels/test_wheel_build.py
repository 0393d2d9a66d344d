"""The contents of wheels: those of catkin's install space, and what packages of many forms lack."""

import base64
import contextlib
import csv
import hashlib
import os
import re
import shutil
import zipfile
from email.parser import HeaderParser
from pathlib import Path

import pytest

from pipros.basics.errors import PiprosError
from pipros_wheels import package_build
from pipros_wheels.commands.wheel import main
from pipros_wheels.dependencies import dependencies_of
from pipros_wheels.file_tree import WheelRefused
from pipros_wheels.wheel_build import BuiltWheel, WheelOptions, build_wheels, source_packages
from tests.support.constants import Constants
from tests.support.workspaces import Workspace, hide_setuptools

MESSAGES = (
    "find_package(catkin REQUIRED COMPONENTS message_generation std_msgs)\n"
    "add_message_files(FILES State.msg)\ngenerate_messages(DEPENDENCIES std_msgs)\ncatkin_package()"
)
SETUP = (
    "from distutils.core import setup\n"
    "setup(packages=['{0}'], package_dir={{'': 'src'}}, scripts=['bin/tool'])\n"
)


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    hide_setuptools(tmp_path, monkeypatch)
    return Workspace(tmp_path / "ws")


def wheels(workspace: Workspace, **options: bool) -> dict[str, BuiltWheel]:
    space = source_packages([workspace.base])
    output = workspace.base / "dist"
    built = build_wheels(space.packages, output, WheelOptions(**options), workspace.lines.append)  # type: ignore[arg-type]
    if space.errors or built.errors:
        raise PiprosError("\n".join([*space.errors, *built.errors]))
    return {wheel.package.name: wheel for wheel in built.wheels}


def names(wheel: BuiltWheel) -> dict[str, zipfile.ZipInfo]:
    """Return the entries by their path in the install space."""
    with zipfile.ZipFile(wheel.file) as archive:
        infos = {info.filename: info for info in archive.infolist()}
    return {
        re.sub(
            r".*\.data/(?:data/|scripts(/))", lambda match: f"bin{match[1]}" if match[1] else "", path
        ): info
        for path, info in infos.items()
    }


def content(wheel: BuiltWheel, end: str) -> str:
    with zipfile.ZipFile(wheel.file) as archive:
        (path,) = [name for name in archive.namelist() if name.endswith(end)]
        return archive.read(path).decode()


def extend(folder: Path, elements: str) -> None:
    """Add elements to the manifest of a package."""
    file = folder / "package.xml"
    file.write_text(file.read_text().replace("</package>", f"{elements}</package>"))


def required(wheel: BuiltWheel) -> list[str]:
    return HeaderParser().parsestr(content(wheel, "METADATA")).get_all("Requires-Dist") or []


def add_arm(workspace: Workspace) -> Path:
    cmake = (
        "find_package(catkin REQUIRED COMPONENTS message_generation std_msgs)\n"
        "catkin_python_setup()\nadd_message_files(FILES State.msg)\n"
        "generate_messages(DEPENDENCIES std_msgs)\ncatkin_package()\n"
        "catkin_install_python(PROGRAMS scripts/move DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
        "install(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})"
    )
    files = {
        "msg__State_dot_msg": "std_msgs/Header header\nint8 now\n",
        "setup_dot_py": SETUP.format("arm_lib"),
        "src__arm_lib____init____dot_py": "",
        "scripts__move": "#!/usr/bin/env python\n",
        "launch__run_dot_launch": "<launch/>",
        "bin__tool": "#!/bin/sh\n",
    }
    folder = workspace.add(
        "arm", cmake, "std_msgs", **{key: text for key, text in files.items() if "arm_lib" not in key}
    )
    (folder / "src" / "arm_lib").mkdir(parents=True)
    (folder / "src" / "arm_lib" / "__init__.py").write_text("WHO = 'arm'\n")
    return folder


def test_a_wheel_has_the_files_of_the_install_space(workspace: Workspace) -> None:
    add_arm(workspace)
    found = names(wheels(workspace)["arm"])
    assert workspace.build(installs=True).errors == []
    install = workspace.layout.install
    expected = {
        file.relative_to(install).as_posix().removeprefix("lib/python3/dist-packages/")
        for folder in ("bin", "lib", "share")
        for file in (install / folder).rglob("*")
        if file.is_file()
    }
    made = {path for path in found if ".dist-info/" not in path and not path.startswith("share/pipros/")}
    assert made == expected
    assert {"arm_lib/__init__.py", "arm/msg/__init__.pyi", "lib/arm/move", "lib/arm/tool"} < made
    programs = [path for path, info in found.items() if info.external_attr >> 16 & 0o111]
    assert programs == ["lib/arm/move", "lib/arm/tool", "bin/tool"]


@pytest.mark.skipif(os.name == "nt", reason="a limit stands for the full disk")
def test_a_wheel_for_which_there_is_no_room_leaves_the_old_one(workspace: Workspace) -> None:
    import resource

    add_arm(workspace)
    wheel = wheels(workspace)["arm"].file
    old = wheel.read_bytes()
    for number in range(3):
        (workspace.base / "src" / "arm" / "launch" / f"{number}.launch").write_bytes(os.urandom(60_000))
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    try:
        with pytest.raises(PiprosError, match=rf"arm: .*File too large: .*{wheel.name}'$"):
            wheels(workspace)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert (wheel.read_bytes(), list(wheel.parent.iterdir())) == (old, [wheel])


def test_conditions_of_a_manifest_choose_requirements(workspace: Workspace) -> None:
    file = workspace.add("arm") / "package.xml"
    file.write_text(file.read_text().replace('format="2"', 'format="3"'))
    for version, key in ((2, "python3-numpy"), (3, "python3-serial")):
        condition = f'condition="$ROS_PYTHON_VERSION == {version}"'
        extend(file.parent, f"<exec_depend {condition}>{key}</exec_depend>")
    assert required(wheels(workspace)["arm"]) == ["pipros", "pyserial"]


def test_two_builds_have_the_same_bytes(workspace: Workspace, tmp_path: Path, monkeypatch) -> None:
    folder = add_arm(workspace)
    first = wheels(workspace)["arm"].file.read_bytes()
    for file in folder.rglob("*"):
        os.utime(file, (1, 1))
    assert wheels(workspace)["arm"].file.read_bytes() == first
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    dates = {info.date_time for info in names(wheels(workspace)["arm"]).values()}
    assert dates == {(2023, 11, 14, 22, 13, 20)}
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "soon")
    with pytest.raises(PiprosError, match=r"seconds since 1970, .*, got \[soon\]"):
        wheels(workspace)


def test_record_has_the_hash_and_size_of_each_file(workspace: Workspace) -> None:
    add_arm(workspace)
    wheel = wheels(workspace)["arm"]
    with zipfile.ZipFile(wheel.file) as archive:
        rows = list(csv.reader(content(wheel, "RECORD").splitlines()))
        assert [row[0] for row in rows] == archive.namelist()
        for path, digest, size in rows[:-1]:
            data = archive.read(path)
            encoded = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            assert (digest, int(size)) == (f"sha256={encoded}", len(data))
    assert rows[-1][1:] == ["", ""]


def test_dependencies_become_requirements_or_are_listed(workspace: Workspace) -> None:
    workspace.add("arm_msgs", MESSAGES, "std_msgs message_runtime", msg__State_dot_msg="int8 a")
    folder = workspace.add(
        "arm", "catkin_package()", "arm_msgs rospy python3-serial python3-yaml mavros strange"
    )
    file = folder / "package.xml"
    file.write_text(file.read_text().replace("<depend>arm_msgs", '<depend version_gte="0.1">arm_msgs'))
    extend(folder, "<test_depend>rostest</test_depend><build_depend>unknown</build_depend>")
    built = wheels(workspace)
    assert list(built) == ["arm_msgs", "arm"]
    assert required(built["arm"]) == ["pipros", "ros1-arm-msgs>=0.1", "pyserial"]
    assert required(built["arm_msgs"]) == ["pipros"]
    assert "Dependencies that pip does not install: mavros, strange" in content(built["arm"], "METADATA")


def test_message_packages_that_are_absent_are_named_and_not_checked(
    workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cmake = MESSAGES.replace("std_msgs", "other_msgs")
    workspace.add("arm_msgs", cmake, "other_msgs", msg__State_dot_msg="other_msgs/Hand[] hands")
    wheel = wheels(workspace)["arm_msgs"]
    assert required(wheel) == ["pipros"]  # anyone could register ros1-other-msgs
    assert wheel.missing == ("other_msgs",)
    assert "Dependencies that pip does not install: other_msgs" in content(wheel, "METADATA")
    (tmp_path / "ros1_other_msgs-1.0-py3-none-any.whl").touch()
    monkeypatch.setenv("PIP_FIND_LINKS", tmp_path.as_uri())
    wheel = wheels(workspace)["arm_msgs"]
    assert required(wheel) == ["pipros", "ros1-other-msgs"]
    assert "hands: list[other_msgs.msg.Hand]" in content(wheel, "msg/__init__.pyi")


def test_compiled_targets_are_left_out_and_named(workspace: Workspace) -> None:
    cmake = (
        "find_package(catkin REQUIRED COMPONENTS roscpp)\ncatkin_package()\n"
        "add_executable(talker src/talker.cpp)\n"
        "install(TARGETS talker DESTINATION lib)\ninstall(PROGRAMS scripts/move DESTINATION lib/arm)"
    )
    workspace.add("arm", cmake, "roscpp", scripts__move="#!/bin/sh\n")
    wheel = wheels(workspace)["arm"]
    file = workspace.base / "src" / "arm" / "CMakeLists.txt"
    assert wheel.notes == (f"left out, because they are compiled: talker ({file}:5)",)
    assert "lib/arm/move" in names(wheel)
    assert "Compiled targets that are left out: talker" in content(wheel, "METADATA")
    with pytest.raises(PiprosError, match=r"arm compiles talker .*no compiled code"):
        wheels(workspace, is_strict=True)


def test_a_macro_that_cannot_be_followed_adds_the_folder(workspace: Workspace) -> None:
    cmake = "find_package(catkin REQUIRED COMPONENTS far)\ncatkin_package()\nfar_install_all(config)"
    workspace.add("arm", cmake, config__a_dot_yaml="a: 1", _dot_hidden="x")
    wheel = wheels(workspace)["arm"]
    assert [note for note in wheel.notes if ":5: the package needs far_install_all()" in note] == list(
        wheel.notes
    )
    assert "share/arm/config/a.yaml" in names(wheel)
    assert not any("hidden" in name for name in names(wheel))


def test_a_package_for_ros_2_gets_advice(workspace: Workspace) -> None:
    folder, advised = workspace.add("arm", ""), ["is a package for ROS 2 (build type ament_python)"]
    text = (folder / "package.xml").read_text()
    both = '<export><build_type condition="$ROS_VERSION == 2">ament_python</build_type></export>'
    only = "<export><build_type>ament_python</build_type></export>"
    for export, advice in (("", []), (both, []), (only, advised)):
        (folder / "package.xml").write_text(text)
        extend(folder, export)
        found = [note for note in wheels(workspace)["arm"].notes if "ROS 2" in note]
        assert [note.partition(",")[0] for note in found] == advice


def test_a_package_for_ros2_has_one_note(workspace: Workspace) -> None:
    """It is recognized by its build tool, if it exports no build type."""
    cmake = "find_package(ament_cmake REQUIRED)\nament_export_dependencies(rclpy)\nament_package()"
    manifest = workspace.add("arm", cmake) / "package.xml"
    text = manifest.read_text()
    manifest.write_text(text.replace(">catkin</buildtool_depend>", ">ament_cmake</buildtool_depend>"))
    [note] = wheels(workspace)["arm"].notes
    assert note.startswith("is a package for ROS 2 (build type ament_cmake)")


@pytest.mark.parametrize(("first", "expected"), [
    ("#!/usr/bin/env python", "#!python"),
    ("#! /usr/bin/python3.8 -u\r", "#!python\r"),
    ("#!/usr/bin/env -S python3 -u", "#!python"),
    ("#!/usr/bin/env python2", "#!/usr/bin/env python2"),
    ("#!/bin/sh", "#!/bin/sh"),
    ("#!/usr/bin/env pythonista", "#!/usr/bin/env pythonista"),
])  # fmt: skip
def test_scripts_of_setup_py_run_with_the_interpreter_of_the_environment(
    workspace: Workspace, first: str, expected: str
) -> None:
    """pip replaces the first line `#!python`."""
    setup = "from catkin_pkg.python_setup import generate_distutils_setup\nfrom setuptools import setup\n"
    setup += "setup(**generate_distutils_setup(scripts=['bin/tool']))\n"
    cmake = "find_package(catkin REQUIRED)\ncatkin_python_setup()\ncatkin_package()"
    folder = workspace.add("arm", cmake, setup_dot_py=setup, bin__tool="")
    (folder / "bin/tool").write_bytes(f"{first}\n#!/usr/bin/env python\n".encode())
    made = content(wheels(workspace)["arm"], ".data/scripts/tool")
    assert made == f"{expected}\n#!/usr/bin/env python\n"


def test_requirements_that_the_manifest_exports_for_pip_are_required(workspace: Workspace) -> None:
    """catkin_virtualenv installs them."""
    folder = workspace.add("arm", "find_package(catkin REQUIRED)\ncatkin_package()")
    extend(folder, "<export><pip_requirements>requirements.txt</pip_requirements></export>")
    with pytest.raises(WheelRefused, match=r"cannot read .*requirements\.txt: No such file"):
        dependencies_of(source_packages([workspace.base]).packages[0], None, lambda _name: False, {})
    (folder / "requirements.txt").write_text(
        "# pinned\nmatplotlib==3.8 \\\n    --hash=sha256:0\nrequests[s] >=2 ; python_version < '4' # x\n"
        "-e .\nmine @ https://example.org/mine.zip\n"
    )
    wheel = wheels(workspace)["arm"]
    assert required(wheel) == ["pipros", "matplotlib==3.8", "requests[s] >=2 ; python_version < '4'"]
    left_out = "does not install: -e . (requirements.txt), mine @ https://example.org/mine.zip"
    assert left_out in content(wheel, "METADATA")


def test_a_package_that_installs_nothing_is_added_as_a_whole(workspace: Workspace) -> None:
    folder = workspace.add(
        "arm", MESSAGES, "std_msgs", msg__State_dot_msg="int8 a", launch__a_dot_launch="<launch/>"
    )
    (folder / "src" / "arm").mkdir(parents=True)
    (folder / "src" / "arm" / "__init__.py").write_text("WHO = 'arm'")
    wheel = wheels(workspace)["arm"]
    assert "installs no files, so the folder is added as a whole" in wheel.notes[0]
    assert "share/arm/launch/a.launch" in names(wheel)
    assert content(wheel, "arm/__init__.py") == "WHO = 'arm'"


def test_modules_of_a_package_that_is_added_as_a_whole_are_in_the_wheel_once(workspace: Workspace) -> None:
    folder = add_arm(workspace)
    file = folder / "CMakeLists.txt"
    kept = [line for line in file.read_text().splitlines() if "install" not in line]
    file.write_text("\n".join(kept))
    (folder / "src" / "arm_lib" / "curve.yaml").write_text("a: 1\n")
    (folder / "scripts" / "arm_lib.py").write_text("WHO = 'another'\n")
    found = names(wheels(workspace)["arm"])
    assert [name for name in found if "arm_lib" in name] == [
        "arm_lib/__init__.py", "arm_lib/curve.yaml", "share/arm/scripts/arm_lib.py",
        "share/arm/src/arm_lib/curve.yaml", "share/pipros/modules/arm_lib",
    ]  # fmt: skip


def test_usual_folders_that_are_not_installed_are_named(workspace: Workspace) -> None:
    cmake = "catkin_package()\ninstall(FILES a.txt DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})"
    workspace.add("arm", cmake, a_dot_txt="", launch__a_dot_launch="<launch/>")
    wheel = wheels(workspace)["arm"]
    assert ["launch is not in the wheel" in note for note in wheel.notes] == [True]
    assert "share/arm/launch/a.launch" in names(wheels(workspace, is_whole=True)["arm"])


def test_an_editable_wheel_has_one_pointer(workspace: Workspace) -> None:
    folder = add_arm(workspace)
    wheel = wheels(workspace, is_editable=True)["arm"]
    assert [name for name in names(wheel) if ".dist-info/" not in name] == ["share/pipros/editable/arm"]
    assert content(wheel, "editable/arm") == f"{folder}\n"


def add_module(workspace: Workspace, package: str, module: str, depends: str = "") -> None:
    cmake = "catkin_python_setup()\ncatkin_package()"
    folder = workspace.add(package, cmake, depends, setup_dot_py=SETUP.format(module), bin__tool="")
    (folder / "src" / module).mkdir(parents=True)
    (folder / "src" / module / "__init__.py").write_text("")


def test_a_package_of_pipros_is_built_whole_or_not_at_all(workspace: Workspace) -> None:
    add_module(workspace, "rosapi", "rosapi")
    workspace.add("robot", depends="rosapi std_msgs")
    workspace.add("std_msgs", MESSAGES.replace(" std_msgs", ""), msg__State_dot_msg="int8 a")
    build = build_wheels(source_packages([workspace.base]).packages, workspace.base, WheelOptions(), print)
    assert [wheel.package.name for wheel in build.wheels] == ["std_msgs", "robot"]
    assert build.left_out[0].startswith(
        "rosapi: not built, because pipros itself installs this package, and its"
    )
    assert (len(build.left_out), build.errors) == (1, [])
    assert required(build.wheels[1]) == ["pipros", "ros1-std-msgs"]
    assert "share/std_msgs/msg/State.msg" in names(build.wheels[0])


def test_modules_of_pipros_are_not_overwritten(workspace: Workspace) -> None:
    add_module(workspace, "arm", "tf")
    wheel = wheels(workspace)["arm"]
    assert "left out: the Python module tf, which pipros itself installs" in wheel.notes
    assert "tf/__init__.py" not in names(wheel)


def test_modules_that_are_on_pypi_are_required_from_there(workspace: Workspace) -> None:
    folder = workspace.add("xacro", "catkin_package()", scripts__a="#!/bin/sh\n")
    (folder / "src" / "xacro").mkdir(parents=True)
    (folder / "src" / "xacro" / "__init__.py").write_text("WHO = 'xacro'")
    wheel = wheels(workspace)["xacro"]
    assert wheel.notes[1:] == (
        "left out: the Python module xacro, which the PyPI project xacro>=1.13.3 installs",
    )
    assert not any(name.startswith("xacro/") for name in names(wheel))
    assert required(wheel) == ["pipros", "xacro>=1.13.3"]


def test_a_package_that_needs_xacro_requires_it_from_pypi(workspace: Workspace) -> None:
    workspace.add("my_description", "catkin_package()", "xacro")
    assert required(wheels(workspace)["my_description"]) == ["pipros", "xacro>=1.13.3"]


def add(cmake: str = "catkin_package()", name: str = "arm", **files: str) -> tuple[str, str, dict[str, str]]:
    return name, cmake, files


TWICE = MESSAGES.replace("State.msg", "State.msg a/State.msg")
REFUSED = {
    "a_malformed_manifest": ([add(package_dot_xml="<package")], "package.xml:1"),
    "a_cycle": ([add(name="a"), add(name="b")], "depend on each other"),
    "one_name_twice": ([add(name="x1"), add(name="x2")], "Multiple packages found with the same name"),
    "an_illegal_name": ([add(name="arm_")], r"package name \[arm_\] must consist of letters"),
    "one_distribution_twice": (
        [add(name="my_arm"), add(name="my-arm")],
        "both be distributed as ros1-my-arm",
    ),
    "one_message_twice": (
        [add(TWICE, msg__State_dot_msg="", msg__a__State_dot_msg="")],
        "arm/State is defined twice",
    ),
    "an_invalid_message": ([add(MESSAGES, msg__State_dot_msg="int8 8")], "State.msg:1"),
    "a_missing_file": ([add("catkin_package()\ninstall(FILES a DESTINATION share)")], "cannot find"),
    "no_packages": ([], "there is no package.xml in"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wheels_that_are_refused(workspace: Workspace, case: str) -> None:
    packages, message = REFUSED[case]
    other = {"a": "b", "b": "a"}
    for name, cmake, files in packages:
        depends = other.get(name, "std_msgs message_runtime" if cmake.startswith("find") else "")
        folder = workspace.add(name, cmake, depends, **files)
        if name in ("x1", "x2"):
            text = (folder / "package.xml").read_text()
            (folder / "package.xml").write_text(text.replace(f"<name>{name}", "<name>x"))
    with pytest.raises(PiprosError, match=message):
        wheels(workspace)
    assert list((workspace.base / "dist").glob("*")) == []


@pytest.mark.parametrize(("target", "is_allowed"), [
    ("../../../secret", False), ("/etc/hostname", False), ("real.txt", True), ("gone", False),
    ("more/inside.txt", True),
])  # fmt: skip
def test_links_that_leave_the_package_are_refused(
    workspace: Workspace, target: str, is_allowed: bool
) -> None:
    cmake = (
        "catkin_package()\ninstall(FILES real.txt link.txt DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})"
    )
    folder = workspace.add("arm", cmake, real_dot_txt="content", more__inside_dot_txt="content")
    (folder / "link.txt").symlink_to(target)
    (workspace.base / "secret").write_text("secret")
    if is_allowed:
        assert content(wheels(workspace)["arm"], "link.txt") == "content"
    else:
        with pytest.raises(PiprosError, match=r"link\.txt"):
            wheels(workspace)


def test_files_outside_of_the_prefix_are_left_out(workspace: Workspace, tmp_path: Path) -> None:
    cmake = (
        f"catkin_package()\ninstall(FILES a.rules DESTINATION {tmp_path}/rules.d)\n"
        "install(FILES a.rules DESTINATION share/../../up)\ninstall(FILES a.rules DESTINATION share)"
    )
    workspace.add("arm", cmake, a_dot_rules="x")
    wheel = wheels(workspace)["arm"]
    assert [note.split(",")[1] for note in wheel.notes] == [" installed outside of the prefix"] * 2
    assert not (tmp_path / "rules.d").exists()


@pytest.mark.parametrize(("cmake", "reason"), [
    ("install(FILES a.txt DESTINATION share/arm RENAME ../../../../up.txt)", "outside of the prefix"),
    ("install(PROGRAMS a.txt DESTINATION lib RENAME {base}/up.txt)", "outside of the prefix"),
    ("install(DIRECTORY data DESTINATION share/arm)\ninstall(FILES a.txt DESTINATION share/arm/data/up)",
     "through a link"),
    ("install(DIRECTORY data DESTINATION share)\ninstall(DIRECTORY more/ DESTINATION share/data/up)",
     "through a link"),
])  # fmt: skip
def test_nothing_is_written_outside_of_the_build_of_a_wheel(
    workspace: Workspace, cmake: str, reason: str
) -> None:
    cmake = f"catkin_package()\n{cmake.format(base=workspace.base)}"
    folder = workspace.add("arm", cmake, a_dot_txt="x", data__b_dot_txt="x", more__c_dot_txt="x")
    (folder / "data" / "up").symlink_to("../..")
    before = sorted(workspace.base.rglob("*"))
    with pytest.raises(PiprosError, match=rf"arm/CMakeLists.txt:[45]: .* would be installed .*{reason}"):
        wheels(workspace)
    assert [path for path in sorted(workspace.base.rglob("*")) if "dist" not in path.parts] == before


@pytest.mark.parametrize("name", ["{base}/up", "../up", "a/../../up", ".{base}/up"])
@pytest.mark.parametrize("kind", ["packages", "py_modules"])
def test_no_name_in_a_setup_py_leads_out_of_the_folder_of_modules(
    workspace: Workspace, name: str, kind: str
) -> None:
    name = name.format(base=workspace.base)
    folders = {"": "src", name: "src"}
    setup = f"from setuptools import setup\nsetup({kind}=[{name!r}], package_dir={folders})\n"
    workspace.add("arm", "catkin_python_setup()", setup_dot_py=setup, src__up_dot_py="x")
    reason = r"arm/setup.py: the name of a package or module must not lead out of the folder of all modules"
    with pytest.raises(PiprosError, match=reason):
        wheels(workspace)
    assert reason in "\n".join(workspace.build(installs=True).errors)
    assert not list(workspace.base.glob("up*"))


def test_two_packages_cannot_install_one_file(workspace: Workspace) -> None:
    for name in ("a", "b"):
        workspace.add(name, "catkin_package()\ninstall(FILES c DESTINATION share/common)", c="")
    with pytest.raises(PiprosError, match="packages a and b both install data/share/common/c"):
        wheels(workspace)


def test_a_wheel_has_a_limited_size(workspace: Workspace, constants: Constants) -> None:
    constants(WHEEL_BYTES=1000)
    workspace.add("arm", big_dot_stl="x" * 1001)
    with pytest.raises(PiprosError, match=r"exceed 1000 bytes"):
        wheels(workspace)


@pytest.mark.parametrize("cmake", [
    "install(FILES /etc/hostname DESTINATION share/arm)",
    "install(PROGRAMS ../../secret DESTINATION lib/arm)",
    "set(WHERE ${CMAKE_CURRENT_SOURCE_DIR}/..)\ninstall(FILES ${WHERE}/../secret DESTINATION share/arm)",
    "install(FILES out/secret DESTINATION share/arm)", "install(FILES $ENV{SECRET} DESTINATION share/arm)",
    "install(DIRECTORY / DESTINATION share/arm)", "install(DIRECTORY .. DESTINATION share/arm)",
    "catkin_install_python(PROGRAMS ../../secret DESTINATION lib/arm)", "install(SCRIPT ../../secret)",
])  # fmt: skip
def test_files_from_outside_of_the_package_are_refused_with_file_and_line(
    workspace: Workspace, cmake: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SECRET", str(workspace.base / "secret"))
    (workspace.base / "secret").write_text("secret")
    folder = workspace.add("arm", f"catkin_package()\n{cmake}")
    (folder / "out").symlink_to("../..")
    with pytest.raises(
        PiprosError, match=r"arm/CMakeLists.txt:[45]: the package installs .* outside of the package"
    ):
        wheels(workspace)
    assert list((workspace.base / "dist").iterdir()) == []


@pytest.mark.parametrize("arguments", [
    "packages=['a'], package_dir={'a': '../../secrets'}", "scripts=['../../secrets/__init__.py']",
    "py_modules=['secrets.a'], package_dir={'': '../..'}", "data_files=[('share/arm', ['/etc/hostname'])]",
])  # fmt: skip
def test_a_setup_py_installs_no_files_from_outside_of_the_package(
    workspace: Workspace, arguments: str
) -> None:
    (workspace.base / "secrets").mkdir()
    (workspace.base / "secrets" / "__init__.py").touch()
    setup = f"from setuptools import setup\nsetup({arguments})\n"
    workspace.add("arm", "catkin_python_setup()\ncatkin_package()", setup_dot_py=setup)
    with pytest.raises(PiprosError, match=r"arm/setup.py: the package installs .* outside of the package"):
        wheels(workspace)


def test_data_files_of_a_setup_py_are_not_written_outside_of_the_installation(workspace: Workspace) -> None:
    files = f"[('{workspace.base}/out', ['a.rules']), ('share', ['a.rules'])]"
    setup = f"from setuptools import setup\nsetup(data_files={files})\n"
    workspace.add("arm", "catkin_python_setup()\ncatkin_package()", setup_dot_py=setup, a_dot_rules="x")
    wheels(workspace)
    assert not (workspace.base / "out").exists()


def test_a_folder_that_is_too_large_is_refused_before_it_is_copied(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch, constants: Constants
) -> None:
    constants(WHEEL_BYTES=10_000)
    copied: list[object] = []
    monkeypatch.setattr(package_build, "install_package", lambda *arguments: copied.append(arguments))
    cmake = "catkin_package()\ninstall(DIRECTORY bags DESTINATION share/arm PATTERN *.log EXCLUDE)"
    workspace.add("arm", cmake, bags__a_dot_bag="x" * 10_001)
    with pytest.raises(PiprosError, match=r"CMakeLists.txt:4: the files exceed 10000 bytes"):
        wheels(workspace)
    assert copied == []


EXTRAS = {
    "plain": ("", "{0}"),
    "configured": (".in", "{0}"),
    "template": (".em", "{0}@[if DEVELSPACE]@\n@[end if]@\n"),
}


@pytest.mark.parametrize("kind", EXTRAS)
@pytest.mark.parametrize("user", ["a_user", "z_user"])
@pytest.mark.parametrize("depends", ["tools", ""])
def test_extras_of_another_package_are_used_in_any_order(
    workspace: Workspace, kind: str, user: str, depends: str
) -> None:
    ending, form = EXTRAS[kind]
    text = form.format(
        "macro(lab_install name)\n"
        "  install(FILES ${name} DESTINATION share/${PROJECT_NAME}/lab)\nendmacro()\n"
    )
    folder = workspace.add("tools", "find_package(catkin REQUIRED)\ncatkin_package(CFG_EXTRAS lab.cmake)")
    (folder / "cmake").mkdir()
    (folder / "cmake" / f"lab.cmake{ending}").write_text(text)
    for name in ("between", user):
        cmake = "find_package(catkin REQUIRED COMPONENTS tools)\ncatkin_package()\nlab_install(a.txt)"
        workspace.add(name, cmake, depends if name == user else "tools", a_dot_txt="")
    built = wheels(workspace)
    assert {name: wheel.notes[1:] for name, wheel in built.items()} == dict.fromkeys(
        ("tools", "between", user), ()
    )
    assert f"share/{user}/lab/a.txt" in names(built[user])
    space = source_packages([workspace.base / "src" / user])  # tools is beside it, and not built
    alone = build_wheels(space.packages, workspace.base / "alone", WheelOptions(), workspace.lines.append)
    assert f"share/{user}/lab/a.txt" in names(alone.wheels[0])


@pytest.mark.parametrize("kind", EXTRAS)
def test_extras_of_an_installed_package_are_used(workspace: Workspace, kind: str, monkeypatch) -> None:
    ending, _ = EXTRAS[kind]
    form = {
        "": "{0}",
        ".in": "set(lab_in @PROJECT_NAME@)\n{0}",
        ".em": "{0}@[if INSTALLSPACE]@\nset(lab_in tools)\n@[end if]@\n",
    }[ending]
    text = form.format(
        "include(${tools_DIR}/more.cmake)\n"
        "macro(lab_install name)\n"
        "  install(FILES ${name} DESTINATION share/${PROJECT_NAME}/${lab}${lab_in})\nendmacro()\n"
    )
    cmake = "find_package(catkin REQUIRED)\ncatkin_package(CFG_EXTRAS lab.cmake)\n"
    cmake += "install(FILES cmake/more.cmake DESTINATION share/${PROJECT_NAME}/cmake)"
    folder = workspace.add("tools", cmake, cmake__more_dot_cmake="set(lab lab)")
    (folder / "cmake" / f"lab.cmake{ending}").write_text(text)
    built = wheels(workspace)["tools"]
    prefix = workspace.base / "installed"
    with zipfile.ZipFile(built.file) as archive:
        for name in archive.namelist():
            if ".data/data/" in name:
                target = prefix / name.partition(".data/data/")[2]
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(archive.read(name))
    assert {"lab.cmake", "more.cmake"} <= {each.name for each in (prefix / "share/tools/cmake").iterdir()}
    shutil.rmtree(folder)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(prefix / "share"))
    cmake = "find_package(catkin REQUIRED COMPONENTS tools)\ncatkin_package()\nlab_install(a.txt)"
    workspace.add("user", cmake, "tools", a_dot_txt="")
    where = "lab" if kind == "plain" else "labtools"
    assert f"share/user/{where}/a.txt" in names(wheels(workspace)["user"])


@pytest.mark.parametrize("has_other", [False, True])
def test_each_rosbuild_package_is_named(workspace: Workspace, caplog, has_other: bool) -> None:
    folders = [workspace.base / "src" / name for name in ("old", "older")]
    for folder in folders:
        folder.mkdir(parents=True)
        (folder / "manifest.xml").write_text("<package/>")
    if has_other:
        workspace.add("arm", "")
    with contextlib.nullcontext() if has_other else pytest.raises(WheelRefused, match=r"no package\.xml in "):
        space = source_packages([workspace.base / "src"])
        assert [package.name for package in space.packages] == ["arm"]
        assert not space.errors
    why = "is left out: a package for rosbuild, which catkin replaced in 2012"
    assert caplog.messages == [f"{folder} {why}" for folder in folders]


def test_a_missing_package_is_named_once(workspace: Workspace) -> None:
    cmake = MESSAGES.replace("std_msgs", "other_msgs")
    for name in ("a_msgs", "b_msgs", "c_msgs", "d_msgs", "e_msgs"):
        workspace.add(name, cmake, "other_msgs", msg__State_dot_msg="other_msgs/Hand[] hands")
    space = source_packages([workspace.base])
    built = build_wheels(space.packages, workspace.base / "dist", WheelOptions(), workspace.lines.append)
    [line] = [each for each in built.missing() if "other_msgs" in each]
    assert line.startswith("a_msgs, b_msgs, c_msgs and 2 more do not require other_msgs, because no such")


def test_modules_for_python_2_are_named_once(workspace: Workspace) -> None:
    cmake = "find_package(catkin REQUIRED)\ncatkin_python_setup()\ncatkin_package()"
    setup = "from catkin_pkg.python_setup import generate_distutils_setup\nfrom setuptools import setup\n"
    setup += "setup(**generate_distutils_setup(packages=['arm'], package_dir={'': 'src'}))\n"
    folder = workspace.add("arm", cmake, setup_dot_py=setup, src__arm__new_dot_py="print('new')\n")
    (folder / "src/arm/__init__.py").touch()
    for number in range(6):
        (folder / f"src/arm/old{number}.py").write_text("x = 1\nprint 'old'\n")
    [note] = [each for each in wheels(workspace)["arm"].notes if "Python 3" in each]
    files = ", ".join(f"arm/old{n}.py:2" for n in range(5))
    assert note == f"not valid in Python 3, as if written for Python 2: {files} and 1 more"


# `pipros wheel --ros2`, which `pipros_ros2` translates for, where something is missing.


def test_one_line_says_which_compiler_to_install(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.delenv("CXX", raising=False)

    assert main(["--ros2", "jazzy", "tf2_msgs"]) == 1

    assert capsys.readouterr().err == (
        "pipros wheel: messages for rclpy need a C and a C++ compiler; "
        "on Debian and Ubuntu: apt-get install g++ python3-dev\n"
    )


def test_an_unknown_package_is_named_before_anything_is_installed(tmp_path, monkeypatch, capsys) -> None:
    for variable in ("CC", "CXX"):
        monkeypatch.setenv(variable, "/bin/true")
    monkeypatch.setenv("ROS_HOME", str(tmp_path))

    assert main(["--ros2", "kilted", "-o", str(tmp_path / "dist"), "no_such_msgs"]) == 1

    assert "there is no package no_such_msgs" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []

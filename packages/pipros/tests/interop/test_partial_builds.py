"""One package with C++ that fails takes neither its Python part nor other packages along."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.ros import RosSystem

MANIFEST = """<package format="2"><name>{name}</name><version>1.0.0</version><description>d</description>
<maintainer email="m@example.org">m</maintainer><license>none</license>
<buildtool_depend>catkin</buildtool_depend>{more}</package>"""
CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project({name})
find_package(catkin REQUIRED{components})
catkin_package()
{more}
catkin_install_python(PROGRAMS scripts/hello.py DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}})
"""
COMPILED = """add_executable({name} main.cpp)
install(TARGETS {name} DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}})"""
HELLO = "#!/usr/bin/env python3\nprint('hello')\n"


def add(
    source: Path, name: str, cmake: str = "", needs: str = "", code: str = "int main() {}\n", find: str = ""
) -> None:
    folder = source / name
    (folder / "scripts").mkdir(parents=True)
    (folder / "scripts" / "hello.py").write_text(HELLO)
    (folder / "scripts" / "hello.py").chmod(0o755)
    (folder / "main.cpp").write_text(code)
    more = f"<depend>{needs}</depend>" if needs else ""
    (folder / "package.xml").write_text(MANIFEST.format(name=name, more=more))
    components = f" COMPONENTS {find}" if find else ""
    more = cmake.format(name=name)
    (folder / "CMakeLists.txt").write_text(CMAKE.format(name=name, components=components, more=more))


@pytest.mark.timeout(300)
def test_everything_but_the_failing_programs_is_built(plain_ros: RosSystem) -> None:
    workspace = plain_ros.home / "ws"
    source = workspace / "src"
    add(source, "good", COMPILED)
    add(source, "no_config", f"find_package(NoSuchThing REQUIRED)\n{COMPILED}")
    add(source, "no_component", COMPILED, find="no_such_component")
    add(source, "no_compile", COMPILED, code="nonsense;\n")
    add(source, "needs_config", COMPILED, needs="no_config")
    add(source, "only_python", needs="no_config", find="move_base_that_is_absent")
    side = plain_ros.pipros
    side.environment["PATH"] += ":/usr/bin"
    side.environment.pop("ROS_PACKAGE_PATH")

    built = side.run("catkin_make", "-C", workspace, "install", timeout_s=200)

    assert built.returncode == 1
    failed = built.output[built.output.index("3 package(s) failed") :]
    assert "no_config: CMake Error at no_config/CMakeLists.txt:5 (find_package): By not providing" in failed
    assert "no_component: CMake Error at" in failed
    assert "no_compile: " in failed
    assert "error: " in failed[failed.index("no_compile: ") :].splitlines()[0]
    assert "skipped: needs_config (needs no_config)" in failed
    assert "only_python compiles nothing, so it is built anyway" in built.output
    for space in ("devel", "install"):
        programs = workspace / space / "lib"
        for name in ("good", "no_config", "no_component", "no_compile", "needs_config", "only_python"):
            assert (programs / name / "hello.py").is_file(), (space, name)
        assert (programs / "good" / "good").is_file()
        assert not (programs / "needs_config" / "needs_config").exists()

    (source / "no_compile" / "main.cpp").write_text("int main() {}\n")
    again = side.run("catkin_make", "-C", workspace, timeout_s=200)
    assert "2 package(s) failed" in again.output
    assert (workspace / "devel" / "lib" / "no_compile" / "no_compile").is_file()

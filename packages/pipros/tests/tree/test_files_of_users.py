"""One function opens the files that users name, and one writes them. Other ways are listed, with a reason.

`open_file` refuses pipes, folders and devices, which could block or never end; `replaced_file` keeps the old
file if the disk is full.
"""

from __future__ import annotations

import ast
from pathlib import Path

from tests.support.environments import SHIPPED, files_below, import_path, source_files
from tests.support.trees import nodes_of, parsed

KERNEL = "the kernel's files in /proc and /sys"
OWN = "files that pipros has created, in a folder that is not the user's or is new"
LOG = "a log, which grows, or a file of the process's id"
INSTALLED = "files of an installed package; imports of messages must load few modules"
DESCRIPTOR = "a descriptor that is open"
WHOLE = "is one of the functions, or renames the file itself when it is complete"
OTHERS = {
    KERNEL: {
        "diagnostic_common_diagnostics/nodes/sensors_monitor.py",
        "pipros/net/local_stream.py",
        "pipros/net/port_holders.py",
        "pipros/net/this_machine.py",
        "pipros_libraries/reconfigure/cfg_file.py",
        "pipros_page/process_usage.py",
        "pipros_ros2/rtps/unseen.py",
        "pipros_server/stop_guardian.py",
        "pipros_tools/launch/guardian.py",
    },
    OWN: {
        "actionlib_tools/edit.py",
        "pipros/basics/cache_files.py",
        "pipros/basics/posix.py",
        "pipros_data/limited_query.py",
        "pipros_fleet/certificates.py",
        "pipros_fleet/history_files.py",
        "pipros_libraries/reconfigure/generator.py",
        "pipros_server/desktop.py",
        "pipros_wheels/backend.py",
        "pipros_wheels/ros2_wheel.py",
        "pipros_workspace/catkin/templates.py",
        "pipros_workspace/cmake/files.py",
    },
    LOG: {"pipros_tools/cli/roslaunch.py", "pipros_tools/launch/logs.py", "pipros_tools/launch/process.py"},
    INSTALLED: {
        "pipros/basics/extras.py",
        "pipros/msg/importing/load.py",
        "pipros/packages/distributions.py",
        "pipros/packages/installed_packages.py",
        "pipros/packages/system_packages.py",
        "pipros_rosbag2/interfaces/catalog.py",
        "pipros_server/responses.py",
        "pipros_tools/health/gather_machine.py",
        "pipros_wheels/names.py",
    },
    DESCRIPTOR: {"pipros_assistants/stdio_transport.py", "pipros_tools/cli/entry_point.py"},
    WHOLE: {
        "diagnostic_analysis/exporter.py",
        "pipros/basics/input_file.py",
        "pipros/basics/replaced_file.py",
        "pipros/packages/crawl.py",
        "pipros/packages/setup_modules.py",
        "pipros_rosbag2/bags/mcap_storage.py",
        "pipros_tools/bag/record_files.py",
        "pipros_tools/cli/rosbag/exporting.py",
        "pipros_tools/testing/result_paths.py",
        "pipros_wheels/archive.py",
        "pipros_workspace/run_tests.py",
    },
}
"""Modules that open files in another way."""

METHODS = {"read_text", "read_bytes", "write_text", "write_bytes"}
NOT_PATHS = {"_documents.read_text", "run.write_text"}
"""Methods of the same names."""


def opens_a_file(node: ast.AST) -> bool:
    """Return whether code calls `open` of Python or a path, or a method of a path that reads or writes."""
    match node:
        case ast.Call(ast.Name("open")):
            return True
        case ast.Call(ast.Attribute(attr="open"), [ast.Constant(str(mode)), *_]):
            return set(mode) <= set("rwxabt+")
        case ast.Call(ast.Attribute(attr=name) as method):
            return name in METHODS and ast.unparse(method) not in NOT_PATHS
    return False


def has_its_own_way(file: Path) -> bool:
    return any(map(opens_a_file, nodes_of(parsed(file))))


def test_files_of_users_are_opened_by_the_functions_that_refuse_pipes_and_keep_old_files() -> None:
    files = {import_path(file).as_posix(): file for file in source_files()}
    of_tab = "pipros_tab/"  # it runs in a browser, whose files have no pipes
    found = {name for name, file in files.items() if not name.startswith(of_tab) and has_its_own_way(file)}
    assert found == set().union(*OTHERS.values())


def test_so_do_the_programs_of_shipped_packages() -> None:
    programs = [file for folder in SHIPPED for file in files_below(folder) if file.parent.name == "scripts"]
    assert programs
    assert [file for file in programs if has_its_own_way(file)] == []

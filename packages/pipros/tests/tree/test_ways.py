"""Ways to open files, to ask for the system, and to serve: few modules go them, each with a reason."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from tests.support.environments import (
    PACKAGES,
    REPOSITORY,
    ROOTS,
    SHIPPED,
    SOURCES,
    files_below,
    import_path,
    source_files,
)
from tests.support.trees import nodes_of, parsed

# One function opens the files that users name, and one writes them. Other ways are listed, with a reason.
# `open_file` refuses pipes, folders and devices, which could block or never end; `replaced_file` keeps the
# old file if the disk is full.


KERNEL = "the kernel's files in /proc and /sys"
OWN = "files that pipros has created, in a folder that is not the user's or is new"
LOG = "a log, which grows, or a file of the process's id"
INSTALLED = "files of an installed package; imports of messages must load few modules"
DESCRIPTOR = "a descriptor that is open"
WHOLE = "is one of the functions, or renames the file itself when it is complete"
OTHERS = {
    KERNEL: {
        "diagnostic_common_diagnostics/nodes/sensors_monitor.py", "pipros/net/local_stream.py",
        "pipros/net/port_holders.py", "pipros/net/this_machine.py",
        "pipros_libraries/reconfigure/cfg_file.py", "pipros_page/process_usage.py",
        "pipros_ros2/rtps/unseen.py", "pipros_server/stop_guardian.py", "pipros_tools/launch/guardian.py",
    },
    OWN: {
        "actionlib_tools/edit.py", "pipros/basics/cache_files.py", "pipros/basics/posix.py",
        "pipros_data/limited_query.py", "pipros_fleet/certificates.py", "pipros_fleet/history_files.py",
        "pipros_libraries/reconfigure/generator.py", "pipros_rosbag2/bags/sqlite_files.py",
        "pipros_server/desktop.py", "pipros_wheels/backend.py", "pipros_wheels/ros2_wheel.py",
        "pipros_workspace/catkin/templates.py",
        "pipros_workspace/cmake/files.py",
    },
    LOG: {"pipros_tools/cli/roslaunch.py", "pipros_tools/launch/logs.py", "pipros_tools/launch/process.py"},
    INSTALLED: {
        "pipros/basics/extras.py", "pipros/msg/importing/load.py", "pipros/packages/distributions.py",
        "pipros/packages/installed_packages.py", "pipros/packages/system_packages.py",
        "pipros_rosbag2/interfaces/catalog.py", "pipros_server/responses.py",
        "pipros_tools/health/gather_machine.py", "pipros_wheels/names.py",
    },
    DESCRIPTOR: {"pipros_assistants/stdio_transport.py", "pipros_tools/cli/entry_point.py"},
    WHOLE: {
        "diagnostic_analysis/exporter.py", "pipros/basics/input_file.py", "pipros/basics/replaced_file.py",
        "pipros/packages/crawl.py", "pipros/packages/setup_modules.py", "pipros_rosbag2/bags/mcap_storage.py",
        "pipros_tools/bag/record_files.py", "pipros_tools/cli/rosbag/exporting.py",
        "pipros_wheels/archive.py", "pipros_workspace/run_tests.py",
    },
}  # fmt: skip
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


# Windows's ways stand in the modules that exist for systems, and nothing else assumes POSIX.


SYSTEMS = {
    f"pipros/basics/{name}.py" for name in ("interrupts", "posix", "terminals", "windows", "windows_job")
}
QUESTION = re.compile(r"\bsys\.platform\b|\bos\.name\b")
MOST_QUESTIONS = 50
"""Comparisons with the name of a system outside `SYSTEMS`. Lower this if there are fewer."""

RENAMING = re.compile(r"\bos\.(?:replace|rename)\(|\.(?:rename\([^\"']|replace\([\w.]+\))")
RENAMES = {
    "pipros/basics/cache_files.py": "in a folder's descriptor, which Windows lacks",
    "pipros/basics/log_file.py": "a node does not wait for a reader of its log",
    "pipros/basics/windows.py": "is the function to use",
    "pipros_tools/launch/logs.py": "replaces a link",
    "pipros_robot/navigation/velocities/cmd_vel_mux_node.py": "replaces inputs, not files",
    "pipros/net/local_socket.py": "Linux only",
    "pipros/packages/zipped.py": "a new folder, which nobody has open",
}
"""Modules that rename files, and why they need not wait for programs that have the file open."""

POSIX_ONLY = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
"""Modules of Python that Windows lacks."""


def found(pattern: re.Pattern[str]) -> dict[str, int]:
    """Return how often a pattern occurs in each module."""
    counts = {}
    for file in (each for folder in SOURCES for each in files_below(folder, "*.py")):
        count = len(pattern.findall(file.read_text(encoding="utf-8")))
        if count and "share" not in import_path(file).parts:
            counts[import_path(file).as_posix()] = count
    return counts


def test_files_are_replaced_by_the_function_that_waits_for_other_programs() -> None:
    assert set(found(RENAMING)) == set(RENAMES)


def test_command_lines_are_split_by_the_function_that_keeps_backslashes_on_windows() -> None:
    of_shells = {"pipros_tools/health/gather_machine.py", "pipros_tools/launch/ssh.py"}  # of POSIX
    assert set(found(re.compile(r"shlex\.(?:split|shlex)\("))) == {"pipros/basics/words.py", *of_shells}


def test_ctrl_c_during_the_import_of_numpy_is_not_taken_for_a_missing_library() -> None:
    """`missing`, `required` and `optional` know that numpy turns it into an ImportError."""
    swallowed = [
        f"{import_path(file)}:{node.lineno}"
        for file in source_files()
        for node in nodes_of(parsed(file))
        if isinstance(node, ast.Try)
        and re.search(
            r"(?m)^(import|from) (numpy|cv2)\b|_module\('(numpy|cv2)", "\n".join(map(ast.unparse, node.body))
        )
        and any("ImportError" in ast.unparse(each.type or node) for each in node.handlers)
        and not any("missing(" in ast.unparse(each) for each in node.handlers)
    ]
    assert swallowed == []


def test_few_modules_ask_for_the_system() -> None:
    counts = {name: count for name, count in found(QUESTION).items() if name not in SYSTEMS}
    assert sum(counts.values()) <= MOST_QUESTIONS, counts


def imported_at_start(file: Path) -> Iterator[str]:
    """Yield the names that a file imports without a condition, as modules."""
    for statement in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Import):
            yield from (alias.name for alias in statement.names)
        elif isinstance(statement, ast.ImportFrom) and statement.module:
            yield statement.module
            yield from (f"{statement.module}.{alias.name}" for alias in statement.names)


def test_conftest_imports_nothing_that_windows_lacks() -> None:
    files = [
        REPOSITORY / "conftest.py",
        *(file for package in PACKAGES for file in files_below(package / "tests", "conftest.py")),
    ]
    lacking = set()
    for file in files:  # grows
        for name in imported_at_start(file):
            path = Path(*name.split(".")).with_suffix(".py")
            if name in POSIX_ONLY:
                lacking.add(f"{file.relative_to(REPOSITORY)}: {name}")
            files += {package / path for package in PACKAGES if (package / path).is_file()}.difference(files)
    assert len(files) > 15
    assert not lacking


# Every server whose clients share an event loop gives each of them a `LoopShare`.


OPENING = {
    "websockets.asyncio.server.serve", "websockets.sync.server.serve", "websockets.serve",
    "websockets.server.serve",
    "asyncio.start_server", "asyncio.start_unix_server", "create_server", "create_unix_server",
    "create_datagram_endpoint", "uvicorn.Config", "uvicorn.run",
    "http.server.HTTPServer", "http.server.ThreadingHTTPServer", "socketserver.TCPServer",
    "socketserver.ThreadingTCPServer", "socketserver.UDPServer", "wsgiref.simple_server.make_server",
    "xmlrpc.server.SimpleXMLRPCServer", "aiohttp.web.run_app", "tornado.httpserver.HTTPServer",
}  # fmt: skip
"""Functions and classes that open a server. What `loop.` precedes is a method of the event loop."""

WORDS = {name.rpartition(".")[2] for name in OPENING} - {"serve", "run"} | {"websockets", "uvicorn"}
"""What a module that opens a server contains."""
SHARES = {"pipros_server.loop_share.LoopShare", "pipros_server.loop_share.LoopShares"}
LOOP_OTHERS = {
    "pipros/net/rpc_server.py": "peers of ROS: requests are small, and parsed in slices",
    "pipros_tools/testing/faults/tcp_proxy.py": "a proxy of one test",
    "pipros_tab/serve.py": "a thread for each connection, and only files",
}


def names_of(tree: ast.AST) -> dict[str, str]:
    """Return the full names of what a module imports, by the names that it uses."""
    found: dict[str, str] = {}
    for each in ast.walk(tree):
        if isinstance(each, ast.Import):
            found |= {alias.asname or alias.name: alias.name for alias in each.names}
        elif isinstance(each, ast.ImportFrom):
            found |= {alias.asname or alias.name: f"{each.module}.{alias.name}" for alias in each.names}
    return found


def used(tree: ast.AST) -> Iterator[str]:
    names = names_of(tree)
    for each in ast.walk(tree):
        if isinstance(each, ast.Name):
            yield names.get(each.id, "")
        elif isinstance(each, ast.Attribute):
            base = ast.unparse(each.value)
            yield f"{names.get(base, base)}.{each.attr}"
            yield each.attr


def servers(folder: Path) -> Iterator[tuple[str, bool]]:
    """Yield the modules that open servers, and whether they share the loop."""
    for file in files_below(folder, "*.py"):
        text = file.read_text(encoding="utf-8")
        if any(word in text for word in WORDS):
            tree = ast.parse(text)
            words = set(used(tree))
            if words & OPENING:
                yield import_path(file).as_posix(), bool(words & SHARES)


def test_every_server_shares_its_loop() -> None:
    found = dict(pair for folder in ROOTS for pair in servers(folder))

    assert found.pop("pipros_server/port.py"), "the port of the page, of rosbridge and of Foxglove"
    assert {name for name, shares in found.items() if not shares} == {*LOOP_OTHERS}
    assert len(found) > len(LOOP_OTHERS)

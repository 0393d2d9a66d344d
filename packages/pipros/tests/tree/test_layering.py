"""The packages of pipros: imports point down only, and some functions are forbidden everywhere."""

import ast
import functools
import itertools
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import pytest

from tests.support import documents
from tests.support.absent_plugins import DELETED
from tests.support.environments import FLOORS, REPOSITORY, ROOTS, SOURCES, source, source_files
from tests.support.trees import nodes_of, parsed

ROOTS = ROOTS
"""The folders on `sys.path`: the library, and the packages with Noetic's names."""

# The layers of docs/internals/architecture.md, lowest first. A package imports from lower layers, and on its
# own layer from the sets before its own.
LAYERS: list[list[set[str]]] = [
    [{"basics"}, {"wire", "safe"}],
    [{"packages"}],
    [{"ros1"}, {"msg"}],
    [{"startup", "net"}],
    [{"master", "node"}],
    [
        {"pictures", "reconfigure", "transforms", "filters", "diagnostics", "bonds", "markers"},
        {"maps", "nodelets", "nodes", "robot_model", "topic_tools", "vision"},
        {"actions", "reconfiguring"},
        {"teleoperation"},
    ],
    [{"cmake"}, {"workspace"}, {"policy"}, {"server"}],
    [
        {"launch", "graph", "bag"}, {"testing", "health"},
        {"assistants", "bridges", "data", "fleet", "perception", "rosbag2"},
        {"page", "ros2", "simulation", "tab", "wheels"}, {"navigation"},
    ],
    [{"cli"}],
]  # fmt: skip
LAYER = {package: layer for layer, steps in enumerate(LAYERS) for packages in steps for package in packages}
STEPS = [packages for steps in LAYERS for packages in steps]
STEP = {package: step for step, packages in enumerate(STEPS) for package in packages}

# Facades that import others, because those names are part of their API.
FACADES_BELOW: dict[str, set[str]] = {
    "actionlib": {"rospy"},
    "actionlib_tools": {"actionlib", "genpy", "roslib", "rospy", "rostopic"},
    "bondpy": {"rospy", "smclib"},  # bond.sm is a machine of smclib
    "camera_info_manager": {"camera_calibration_parsers", "rospy"},  # the messages of files
    "diagnostic_aggregator": {"bondpy", "rospy"},
    "diagnostic_common_diagnostics": {"diagnostic_updater", "rospy"},
    "diagnostic_updater": {"rospy"},
    "dynamic_reconfigure": {"rospy", "rosservice"},
    "genpy": {"genmsg"},  # the exceptions of generate_dynamic
    "image_transport": {"cv_bridge", "rospy"},
    "interactive_markers": {"rospy"},
    "map_server": {"rospy"},
    "message_filters": {"rospy"},  # topics, the clock and logs of rospy's node
    "joint_state_publisher": {"rospy"},
    "joint_state_publisher_gui": {"joint_state_publisher", "rospy"},
    "robot_state_publisher": {"rospy", "tf2_ros"},
    "roslaunch": {"rosgraph"},  # names, addresses and environment of rosgraph
    "roslib": {"genmsg", "genpy", "rosgraph"},  # the former home of their names, messages and network
    "rosapi": {"rospy"},
    "rosbag": {"rospy"},  # timestamps are rospy.Time
    "rosbridge_library": {"rospy"},  # the time, logs and node of rospy
    "rosbridge_server": {"rospy"},
    "rosdiagnostic": {"rospy"},
    "rosmaster": {"rosgraph"},  # ROSMasterHandler is a handler of rosgraph.xmlrpc; its log is rosgraph's
    "rosmsg": {"genpy"},  # both have generate_dynamic
    "rosparam": {"rosgraph"},  # get_param_server returns a rosgraph.Master
    "rospy": {"rosgraph"},  # rospy.names has functions of rosgraph.names
    "rostest": {"rosgraph", "roslaunch", "rospy", "rosunit"},  # ROSTestLaunchParent is a launch; logs
    "usb_cam": {"camera_info_manager", "rospy"},
    "tf": {"rospy", "roswtf", "tf2_ros"},  # it has rules for roswtf
    "tf2_geometry_msgs": {"tf2_ros"},  # registers its types there
    "tf2_kdl": {"tf2_geometry_msgs", "tf2_ros"},  # registers its types there
    "tf2_py": {"rospy"},  # returns rospy.Time
    "tf2_ros": {"actionlib", "rosgraph", "rospy", "tf2_py"},
    "tf2_sensor_msgs": {"tf2_geometry_msgs", "tf2_ros"},
    "tf2_web_republisher": {"actionlib", "rospy", "tf2_ros"},
    "topic_tools": {"rosgraph", "rospy", "rostopic"},
    "roswtf": {"rospy"},  # the node of plugins
    "rostopic": {"rosgraph", "rosparam", "rospy"},  # its classes use rospy's node; messages of parameters
}

# The first executes code generated from message definitions; every name in it has passed the grammar.
# The second executes what a user types after `python3 -c` in a browser tab, as Python's own command does.
MAY_EXECUTE = ("pipros/msg/compile/run.py", "pipros_tab/command_run.py")

UNSAFE_YAML_LOADERS = {"Loader", "CLoader", "FullLoader", "CFullLoader", "UnsafeLoader", "CUnsafeLoader"}

FILES = source_files()

SEAMS = {
    "pipros/msg/display.py": {"pictures"},  # a notebook shows a message of an image as a picture
    "pipros/msg/importing/hook.py": {
        "reconfigure"
    },  # `import PACKAGE.cfg.NAME` makes a module of a .cfg file
}
"""Functions that import a higher floor when they are called, each with the reason."""

OWN = frozenset(
    folder.name
    for source_folder in SOURCES
    for folder in source_folder.iterdir()
    if folder.name in FLOORS or (folder / "plugin.py").exists()
)
"""The top-level packages of pipros and its plugins."""

OF_PARTS = frozenset({"pipros_libraries", "pipros_robot", "pipros_tools"})
"""Packages whose parts are packages of their own in the layers."""

PARTS = {"pipros_workspace": {"cmake"}, "pipros_server": {"policy"}}
"""Parts of other packages that are."""


@functools.cache
def parts_of(file: Path) -> tuple[str, ...]:
    """Return the parts of its module name: `pipros`, `master`, `params`, or `rospy`, `core`."""
    root = next(folder for folder in ROOTS if file.is_relative_to(folder))
    return file.relative_to(root).with_suffix("").parts


def package_of(file: Path) -> str:
    """`master` for pipros/master/params.py, `actions` for pipros_libraries/actions/…, `facade` for rospy/…"""
    parts = parts_of(file)
    return package_of_module(".".join(parts)) if parts[0] in OWN else "facade"


def package_of_module(name: str) -> str:
    """Return the package of a module of `pipros` or of a plugin, of which the commands are part of `cli`."""
    top, package, *_ = [*name.split("."), ""]
    if top not in OWN or top == "pipros":
        return package
    if package == "commands":
        return "cli"
    if package in ("plugin", "share"):  # a declaration names the commands of its plugin
        return package
    has_parts = top in OF_PARTS or package in PARTS.get(top, ())
    return package if has_parts and package else top.removeprefix("pipros_")


def imported_modules(tree: ast.Module, file: Path) -> Iterator[tuple[int, str]]:
    for node in nodes_of(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            if node.level:
                package = parts_of(file)[: -node.level]
                module = ".".join([*package, *filter(None, [module])])
            yield node.lineno, module
            if module == "pipros":
                yield from ((node.lineno, f"pipros.{alias.name}") for alias in node.names)


def named_modules(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield modules named in strings: `import_module("x")`, `"-m", "x"`, `"x:function"`, and `pipros…`."""
    for node in nodes_of(tree):
        match node:
            case ast.Call(
                func=ast.Name(id="import_module" | "__import__") | ast.Attribute(attr="import_module"),
                args=[ast.Constant(value=str(module)), *_],
            ):
                yield node.lineno, module
            case ast.List(elts=words) | ast.Tuple(elts=words):
                texts = [word.value if isinstance(word, ast.Constant) else None for word in words]
                for option, module in itertools.pairwise(texts):
                    if option == "-m" and isinstance(module, str):
                        yield node.lineno, module
            case ast.Constant(value=str(text)) if found := re.fullmatch(
                r"(pipros(?:_[a-z0-9]+)?\.[\w.]+|\w+(?:\.\w+)*(?=:))(?::\w+)?", text
            ):
                yield node.lineno, found[1]


def described(file: Path, line: int, what: str) -> str:
    return f"{file.relative_to(REPOSITORY)}:{line}: {what}"


@functools.cache
def facade_names(roots: Sequence[Path]) -> frozenset[str]:
    """Return the packages with Noetic's names below the folders, without those of messages."""
    folders = (folder for root in roots for folder in root.iterdir() if folder.is_dir())
    return frozenset(folder.name for folder in folders if not (folder / "__init__.pyi").is_file()) - OWN


def wrong_imports(file: Path) -> list[str]:
    """Return the imports that point up, or to a facade that is not listed for this one."""
    top_package, package = parts_of(file)[0], package_of(file)
    step = STEP.get(package, len(STEPS))  # facades and the package itself are on top
    facades = facade_names(ROOTS)
    wrong = []
    tree = parsed(file)
    for line, module in sorted({*imported_modules(tree, file), *named_modules(tree)}):
        top = module.partition(".")[0]
        target = package_of_module(module)
        if (
            top in facades - {top_package, *FACADES_BELOW.get(top_package, ())} and package != "share"
        ):  # its programs may do so
            wrong.append(described(file, line, f"{top_package}.{package} imports the facade {top}"))
        elif top not in OWN or target == package:
            continue
        elif STEP.get(target, -1) >= step and target not in SEAMS.get("/".join(parts_of(file)) + ".py", ()):
            wrong.append(described(file, line, f"{package} imports {target}"))
    return wrong


def packages_on_disk() -> set[str]:
    """Return the packages and modules of `pipros`, and the other packages, or their parts."""
    paths = source("pipros").iterdir()
    packages = {path.stem for path in paths if path.suffix == ".py" or (path / "__init__.py").exists()}
    for name in OWN - {"pipros"}:
        parts = {path.parent.name for path in source(name).glob("*/__init__.py")}
        packages |= parts if name in OF_PARTS else {name.removeprefix("pipros_"), *PARTS.get(name, ())}
    return packages - {"__init__"}


def packages_in_the_document() -> dict[str, int]:
    """Return the layer of each package by the table of docs/internals/architecture.md."""
    text = documents.text_of("internals/architecture.md")
    rows = re.findall(r"(?m)^\| `(?:pipros_\w+/(?=\w)|pipros_)?(\w+)(?:\.py|/)` \| (\d) \|", text)
    return {package: int(layer) for package, layer in rows}


PARTS_DELETED = {
    each for name in DELETED for each in (("navigation", "perception") if name == "robot" else (name,))
}


def test_every_package_is_on_a_layer() -> None:
    assert set(LAYER) - PARTS_DELETED == packages_on_disk()


def test_the_document_has_the_same_layers() -> None:
    assert packages_in_the_document() == LAYER


@pytest.mark.parametrize("facade", FACADES_BELOW)
def test_facades_import_only_listed_facades(facade: str) -> None:
    files = [file for file in FILES if parts_of(file)[0] == facade]
    imported = {
        module.partition(".")[0] for file in files for _, module in imported_modules(parsed(file), file)
    }

    assert imported >= FACADES_BELOW[facade]


def banned_constructs(file: Path) -> Iterator[str]:
    tree = parsed(file)
    # In the files that import it from pipros.safe, `yaml` is the guarded one.
    has_raw_yaml = package_of(file) != "safe" and any(
        name == "yaml" for _, name in imported_modules(tree, file)
    )
    for node in nodes_of(tree):
        match node:
            case ast.Call(func=ast.Name(id="eval" | "exec" as name)) if name == "eval" or file not in [
                source(path) for path in MAY_EXECUTE
            ]:
                yield described(file, node.lineno, f"{name}() runs text as code")
            case ast.Call(func=ast.Attribute(value=ast.Name(id="yaml"), attr=name)) if (
                has_raw_yaml and "load" in name
            ):
                yield described(file, node.lineno, f"yaml.{name}() may build objects: use pipros.safe.yaml")
            case ast.Attribute(value=ast.Name(id="yaml"), attr=name) if name in UNSAFE_YAML_LOADERS:
                yield described(file, node.lineno, f"{name} builds objects: use pipros.safe.yaml")
            case ast.Call(func=ast.Attribute(value=ast.Name(id="os"), attr="system" | "popen" as name)):
                yield described(file, node.lineno, f"os.{name}() starts a shell")
            case ast.keyword(arg="shell", value=ast.Constant(value=True)):
                yield described(file, node.lineno, "shell=True starts a shell")
            case ast.ExceptHandler(type=None):
                yield described(file, node.lineno, "a bare except hides Ctrl-C")
            case ast.Import(names=names) if any(alias.name == "pickle" for alias in names):
                yield described(file, node.lineno, "pickle runs code that a stranger wrote")
            case ast.ImportFrom(module="pickle"):
                yield described(file, node.lineno, "pickle runs code that a stranger wrote")
            case ast.Global():
                yield described(file, node.lineno, "state lives in objects, not in module globals")


def test_imports_point_down_only() -> None:
    assert [wrong for file in FILES for wrong in wrong_imports(file)] == []


def test_seams_are_imported_late() -> None:
    for name, packages in SEAMS.items():
        tree = parsed(source(name))
        late = {
            node
            for top in tree.body
            if isinstance(top, ast.FunctionDef | ast.ClassDef)
            for node in ast.walk(top)
        }
        found = {
            package_of_module(node.module or ""): node in late
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and package_of_module(node.module or "") in packages
        }
        assert found == dict.fromkeys(packages, True)


def module_name(file: Path) -> str:
    """Return `pipros.msg.base` for pipros/msg/base.py, `pipros.msg` for pipros/msg/__init__.py."""
    parts = parts_of(file)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported_files(files: Iterable[Path]) -> dict[str, set[str]]:
    """Return the modules of `files`, each with those that it imports, also lazily or for types."""
    modules = {module_name(file): file for file in files}
    found: dict[str, set[str]] = {name: set() for name in modules}
    for name, file in modules.items():
        for node in nodes_of(parsed(file)):
            if isinstance(node, ast.Import):
                found[name] |= {alias.name for alias in node.names} & modules.keys()
            elif isinstance(node, ast.ImportFrom):
                package = parts_of(file)[: -node.level] if node.level else ()
                module = ".".join([*package, *filter(None, [node.module])])
                for alias in node.names:
                    # A name in a package may be a module, or something that its __init__ defines.
                    part = f"{module}.{alias.name}"
                    found[name] |= {part if part in modules else module} & modules.keys()
        found[name].discard(name)
    return found


def in_circles(imports: Mapping[str, set[str]]) -> list[tuple[str, str]]:
    """Return the imports that are part of a cycle: the second module imports the first indirectly."""

    def reached_from(start: str) -> set[str]:
        reached, new = set[str](), [start]
        while new:
            for module in imports[new.pop()] - reached:
                reached.add(module)
                new.append(module)
        return reached

    reach = {name: reached_from(name) for name in imports}
    return sorted((name, other) for name in imports for other in imports[name] if name in reach[other])


def test_no_file_imports_itself_indirectly() -> None:
    assert in_circles(imported_files(FILES)) == []


@pytest.mark.parametrize("line", [
    "from pipros.master import bad", "from pipros.master.bad import name", "from . import bad",
    "def f():\n    import pipros.master.bad", "if TYPE_CHECKING:\n    from .bad import Name",
])  # fmt: skip
def test_a_circle_of_files_is_noticed(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bad = _source(tmp_path, monkeypatch, "from pipros.master.between import Between\nimport os")
    between = bad.with_name("between.py")
    between.write_text(line)
    pair = ("pipros.master.bad", "pipros.master.between")
    assert in_circles(imported_files([bad, between])) == [pair, pair[::-1]]


def logic_taken_from_commands(file: Path) -> list[str]:
    """Return the names besides `main` that a facade imports from commands, which are forbidden."""
    return [
        described(file, node.lineno, f"imports {alias.name} from {node.module}")
        for node in nodes_of(parsed(file))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("pipros_tools.cli")
        for alias in node.names
        if alias.name != "main"
    ]


def test_facades_import_only_main_from_commands() -> None:
    facades = [file for file in FILES if package_of(file) == "facade"]
    assert [taken for file in facades for taken in logic_taken_from_commands(file)] == []


def test_logic_that_a_facade_takes_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = _source(tmp_path, monkeypatch, "from pipros_tools.cli.rosnode.kill import main, kill")

    assert [message.rpartition(": ")[2] for message in logic_taken_from_commands(file)] == [
        "imports kill from pipros_tools.cli.rosnode.kill"
    ]


def test_nothing_dangerous_is_used() -> None:
    assert [banned for file in FILES for banned in banned_constructs(file)] == []


@pytest.mark.parametrize("line", [
    "eval('1')", "exec('a = 1')", "import yaml; yaml.load(text)", "import yaml; loader = yaml.UnsafeLoader",
    "os.system('ls')", "subprocess.run('ls', shell=True)", "import pickle", "from pickle import loads",
    "try:\n    pass\nexcept:\n    pass", "def f():\n    global a",
])  # fmt: skip
def test_each_ban_is_noticed(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = _source(tmp_path, monkeypatch, line)

    assert len(list(banned_constructs(file))) == 1


@pytest.mark.parametrize("line", [
    "from pipros_tools.launch import model", "import pipros_tools.cli", "from pipros import node",
    "import rospy", "importlib.import_module('rospy')",
    "command = [sys.executable, '-m', 'pipros_tools.cli.rosrun']", "target = 'pipros_tools.cli.rosrun:main'",
])  # fmt: skip
def test_an_upward_import_is_found(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = _source(tmp_path, monkeypatch, line)

    assert len(wrong_imports(file)) == 1


def test_a_facade_that_is_not_listed_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _source(tmp_path, monkeypatch, "")
    (tmp_path / "rosparam").mkdir()
    file = tmp_path / "rosparam" / "bad.py"
    (tmp_path / "rosgraph").mkdir()
    file.write_text("import rosgraph\ndef late():\n    import rospy\n")

    assert [message.rpartition(": ")[2] for message in wrong_imports(file)] == [
        "rosparam.facade imports the facade rospy"
    ]


def _source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> Path:
    """A file of the package `master` in its own source tree."""
    (tmp_path / "rospy").mkdir()
    file = tmp_path / "pipros" / "master" / "bad.py"
    file.parent.mkdir(parents=True)
    file.write_text(text)
    monkeypatch.setattr(f"{__name__}.ROOTS", (tmp_path,))
    monkeypatch.setattr(f"{__name__}.REPOSITORY", tmp_path)
    return file


def test_the_gateway_to_ros2_loads_no_other_plugin() -> None:
    program = "import pipros_ros2.gateway, sys; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    plugins = ("pipros_bridges", "pipros_fleet", "pipros_simulation", "pipros_page")

    assert [module for module in loaded.stdout.split() if module.startswith(plugins)] == []


MAY_KEEP_THE_PROCESS = {"actionlib/simple_action_server": 1}
"""Threads that are not daemons, by module. Each ends soon after the shutdown, whatever others wait for."""


def threads_that_keep_the_process(tree: ast.Module) -> int:
    """Return the number of threads created without `daemon=True`."""
    made = [
        node
        for node in nodes_of(tree)
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("Thread", "threading.Thread")
    ]
    return sum(
        not any(each.arg == "daemon" and ast.unparse(each.value) == "True" for each in call.keywords)
        for call in made
    )


def test_no_thread_that_may_wait_for_ever_keeps_the_process_alive() -> None:
    counts = {file: threads_that_keep_the_process(parsed(file)) for file in FILES}
    found = {"/".join(parts_of(file)): count for file, count in counts.items() if count}
    assert found == MAY_KEEP_THE_PROCESS

"""Plugins can be taken out: no other file imports one, and what is said of them is true."""

import ast
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.basics.plugin_folders import plugin_folders
from pipros.basics.plugin_table import PLUGINS as TABLE
from pipros.basics.plugins import loaded, named_plugins
from tests.support import documents
from tests.support.absent_plugins import DELETED
from tests.support.environments import REPOSITORY, ROOTS, files_below
from tests.support.evidence import evidence
from tests.support.project import EXTRAS, PLUGIN_PROJECTS, PROJECT

PLUGINS = dict(zip(plugin_folders(), named_plugins(), strict=True))
"""The plugins of the tree, by import name: those of the default installation, and the other distributions."""

MODULE = re.compile(rf"\b({'|'.join(PLUGINS)})[.:/\"']")
VERSION = PROJECT["project"]["version"]
MAY_IMPORT = {"pipros_robot": {"pipros_simulation"}, "pipros_ros2": {"pipros_rosbag2"}}
"""Plugins that import others, which belong to the default installation."""


def sources() -> Iterator[Path]:
    """Yield all Python files of the library and the facades, and the programs of packages."""
    for root in ROOTS:
        for file in files_below(root):
            if file.suffix == ".py" or (os.access(file, os.X_OK) and file.suffix == ""):
                yield file


def home_of(file: Path) -> str:
    """Return the name of the package or plugin whose folder a file is in: `pipros_page`, or `pipros`."""
    folder = next(each for each in file.resolve().parents if each.parent.name in ("packages", "plugins"))
    return folder.name.replace("-", "_")


def names_of_plugins(text: str) -> Iterator[tuple[int, str]]:
    """Yield each line of a source that names a module of a plugin, with the plugin."""
    for node in ast.walk(ast.parse(text)):
        modules: list[str] = []
        if isinstance(node, ast.Import):
            modules = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules = [node.module]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            modules = [found[1] for found in MODULE.finditer(f'{node.value}"')]
        for module in modules:
            if (top := module.partition(".")[0]) in PLUGINS:
                yield getattr(node, "lineno", 0), top


def test_no_file_names_a_plugin_that_may_be_missing() -> None:
    """Programs of packages start their own plugin; the packages of the default ones are beside the core's."""
    wrong = []
    for file in sources():
        home = home_of(file)
        allowed = {home, *MAY_IMPORT.get(home, ())}
        if "share" in file.parts and home == "pipros":
            allowed = PLUGINS.keys() - {f"pipros_{name}" for name in TABLE}
        for line, name in names_of_plugins(file.read_text(encoding="utf-8")):
            if name not in allowed:
                wrong.append(f"{file.relative_to(REPOSITORY)}:{line}: names {name}")
    assert wrong == []


def test_what_plugins_declare_exists() -> None:
    for package, plugin in PLUGINS.items():
        verbs = [each for commands in plugin.verbs.values() for each in commands.values()]
        targets = [each.target for each in (*plugin.programs.values(), *plugin.subcommands.values(), *verbs)]
        targets += [plugin.limits, plugin.check, *plugin.offers.values(), *plugin.nodelets.values()]
        for target in filter(None, targets):
            assert target.startswith(f"{package}.")
            assert loaded(target)


def test_declarations_import_only_the_class_of_plugins() -> None:
    code = (
        "import sys; before = set(sys.modules); "
        "from pipros.basics.plugins import named_plugins; named_plugins(); "
        "print(*sorted(each for each in set(sys.modules) - before if each.startswith('pipros')))"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    packages = {f"{name}{part}" for name in PLUGINS for part in ("", ".plugin")}
    own = {"pipros.basics", "pipros.basics.plugins", "pipros.basics.plugin_folders"}
    assert set(ended.stdout.split()) - own == packages


def test_a_node_imports_neither_a_plugin_nor_the_server() -> None:
    code = "import rospy, sys; print(*(each for each in sys.modules if each.startswith('pipros')))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    modules = ended.stdout.split()
    assert "pipros.node.node" in modules
    assert [each for each in modules if each.startswith(("pipros_", "pipros_server"))] == []


def test_the_table_of_plugins_in_the_documentation_is_complete() -> None:
    text = (
        (REPOSITORY / "docs" / "internals" / "architecture.md")
        .read_text(encoding="utf-8")
        .partition("| plugin |")[2]
    )
    listed = set(re.findall(r"`(pipros_[a-z]\w+)`", text.partition("\n\n")[0]))
    assert listed - {f"pipros_{name}" for name in DELETED} == set(PLUGINS)


@pytest.mark.parametrize("name", [name for name in TABLE if name not in DELETED])
def test_what_is_said_of_a_plugin_that_is_not_installed_is_true(name: str) -> None:
    plugin, known = PLUGINS[f"pipros_{name}"], TABLE[name]
    verbs = (f"{program} {verb}" for program, verbs in plugin.verbs.items() for verb in verbs)
    commands = [*plugin.programs, *(f"pipros {each}" for each in plugin.subcommands), *verbs]
    assert sorted(commands) == list(known.commands)
    share = Path(plugin_folders()[f"pipros_{name}"], "share")
    assert sorted(each.name for each in share.glob("*")) == known.packages.split()
    project = PLUGIN_PROJECTS[known.distribution]["project"]
    assert sorted(project.get("optional-dependencies", ())) == known.extras.split()


@pytest.mark.parametrize("folder", PLUGIN_PROJECTS)
def test_a_plugin_is_an_ordinary_distribution(folder: str) -> None:
    project = PLUGIN_PROJECTS[folder]["project"]
    assert (project["name"], project["version"]) == (folder, VERSION)
    (pin,) = (each for each in project["dependencies"] if each.startswith("pipros"))
    assert re.fullmatch(rf"pipros(\[\w+\])?=={VERSION}", pin)
    assert EXTRAS[folder.removeprefix("pipros-")] == [f"{folder}=={VERSION}"]
    here = REPOSITORY / "plugins" / folder
    assert (here / "LICENSE").read_bytes() == (REPOSITORY / "LICENSE").read_bytes()
    assert (here / "README.md").is_file()


@pytest.mark.parametrize("folder", PLUGIN_PROJECTS)
def test_the_readme_of_a_plugin_has_the_status_of_each_feature(folder: str) -> None:
    text = (REPOSITORY / "plugins" / folder / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"(?m)^\| (.+?) \| (stable|beta|experimental) \| .+ \|$", text)
    assert dict(rows) == PLUGINS[folder.replace("-", "_")].features
    assert len(text.splitlines()) < 50


def test_the_extra_for_all_plugins_names_all() -> None:
    (requirement,) = EXTRAS["all"]
    assert requirement == f"pipros[{','.join(sorted(TABLE))}]"


DECLARATION = """from pipros.basics.plugins import Plugin
PLUGIN = Plugin("other", "for a test", offers={"test_of_plugins": "pipros_other:GIFT"})
"""


def test_a_plugin_in_the_working_directory_is_not_installed(tmp_path: Path) -> None:
    (tmp_path / "pipros_other").mkdir()
    (tmp_path / "pipros_other" / "plugin.py").write_text("print('it runs')\n")
    code = "from pipros.basics.plugins import named_plugins; print(len(named_plugins()) > 3)"
    ended = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert (ended.stdout, ended.stderr) == ("True\n", "")


@pytest.mark.parametrize(("text", "reason"), [
    ("raise SystemExit(3)", "SystemExit: 3"), ("import no_such_module", "ModuleNotFoundError"),
    ("PLUGIN = 1", "it must name a Plugin, got int"), ("PLUGIN = (", "SyntaxError"),
])  # fmt: skip
def test_a_broken_plugin_is_left_out_by_name(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "pipros_broken").mkdir()
    (tmp_path / "pipros_broken" / "plugin.py").write_text(text)
    code = "from pipros.basics.plugins import named_plugins; print(len(named_plugins()) > 3)"
    ended = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True,
        text=True,
    )  # fmt: skip
    assert ended.stdout == "True\n"
    assert "pipros_broken.plugin is left out: " in ended.stderr
    assert reason in ended.stderr


@pytest.mark.parametrize("place", ["folder", "zip"])
def test_a_plugin_of_others_is_found_by_its_name(place: str, tmp_path: Path) -> None:
    files = {"pipros_other/__init__.py": "GIFT = 'a gift'\n", "pipros_other/plugin.py": DECLARATION}
    entry = tmp_path / "site"
    if place == "zip":
        with zipfile.ZipFile(entry, "w") as archive:
            for name, text in files.items():
                archive.writestr(name, text)
    else:
        for name, text in files.items():
            (entry / name).parent.mkdir(parents=True, exist_ok=True)
            (entry / name).write_text(text)
    code = "from pipros.basics.plugins import offered; print(offered('test_of_plugins'))"
    ended = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(entry)}, capture_output=True,
        text=True,
    )  # fmt: skip
    assert ended.stdout == "a gift\n", ended.stderr


def test_the_page_about_evidence_is_that_of_the_tree() -> None:
    """`script/generate evidence` writes it. The counts of files may be those of the last release."""
    if not DELETED:
        start = "\n## Features of plugins\n"
        assert (
            documents.text_of("reference/evidence.md").partition(start)[2] == evidence().partition(start)[2]
        )

"""The rooms of pipros: imports point left only, and what no room may use."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY

SRC = REPOSITORY / "src"

# Each line may import from itself where rooms are alone, and from all lines above.
LAYERS: list[set[str]] = [
    {"errors", "interrupts"},
    {"names", "env", "wire", "safe"},
    {"msg"},
    {"net", "workspace"},
    {"master", "node"},
    {"launch", "graph"},
    {"testing"},
    {"cli"},
]
LEVEL = {room: level for level, rooms in enumerate(LAYERS) for room in rooms}

# Wires the import hook to the package index when an interpreter starts, and imports neither before it must.
BESIDE_ALL = {"startup"}

# Turns message definitions into classes; every name in what it builds passed the grammar before.
MAY_EXECUTE = {"msg"}

UNSAFE_YAML_LOADERS = {"Loader", "CLoader", "FullLoader", "CFullLoader", "UnsafeLoader", "CUnsafeLoader"}

FILES = sorted(SRC.rglob("*.py"))


def room_of(file: Path) -> str:
    """`master` for pipros/master/server.py, `names` for pipros/names.py, `facade` for rospy/…"""
    parts = file.relative_to(SRC).with_suffix("").parts
    if parts[0] != "pipros":
        return "facade"
    return parts[1] if len(parts) > 1 else "__init__"


def imported_modules(tree: ast.AST, file: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            if node.level:
                package = file.relative_to(SRC).with_suffix("").parts[: -node.level]
                module = ".".join([*package, *filter(None, [module])])
            yield node.lineno, module
            if module == "pipros":
                yield from ((node.lineno, f"pipros.{alias.name}") for alias in node.names)


def described(file: Path, line: int, what: str) -> str:
    return f"{file.relative_to(REPOSITORY)}:{line}: {what}"


def wrong_imports(file: Path) -> list[str]:
    room = room_of(file)
    if room in ("facade", "__init__") or room in BESIDE_ALL:
        return []
    wrong = []
    facades = {folder.name for folder in SRC.iterdir() if folder.is_dir()} - {"pipros"}
    for line, module in imported_modules(ast.parse(file.read_text()), file):
        top, _, rest = module.partition(".")
        target = rest.partition(".")[0]
        if top in facades:
            wrong.append(described(file, line, f"{room} imports the facade {top}"))
        elif top == "pipros" and target and target not in {room, *BESIDE_ALL}:
            if target not in LEVEL:
                wrong.append(described(file, line, f"pipros.{target} is in no layer"))
            elif LEVEL[target] >= LEVEL[room] and not (LEVEL[room] == 1 and LEVEL[target] == 1):
                wrong.append(described(file, line, f"{room} imports {target}"))
    return wrong


def banned_constructs(file: Path) -> Iterator[str]:
    tree = ast.parse(file.read_text())
    # In the files that import it from pipros.safe, `yaml` is the guarded one.
    has_raw_yaml = room_of(file) != "safe" and any(name == "yaml" for _, name in imported_modules(tree, file))
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id="eval" | "exec" as name)) if room_of(file) not in MAY_EXECUTE:
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


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(SRC)))
def test_imports_point_left_only(file: Path) -> None:
    assert wrong_imports(file) == []


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(SRC)))
def test_nothing_dangerous_is_used(file: Path) -> None:
    assert list(banned_constructs(file)) == []


@pytest.mark.parametrize(
    "line",
    [
        "eval('1')",
        "exec('a = 1')",
        "import yaml; yaml.load(text)",
        "import yaml; loader = yaml.UnsafeLoader",
        "os.system('ls')",
        "subprocess.run('ls', shell=True)",
        "import pickle",
        "from pickle import loads",
        "try:\n    pass\nexcept:\n    pass",
        "def f():\n    global a",
    ],
)
def test_each_ban_is_noticed(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = _source(tmp_path, monkeypatch, line)

    assert len(list(banned_constructs(file))) == 1


@pytest.mark.parametrize(
    "line",
    ["from pipros.launch import model", "import pipros.cli", "from pipros import node", "import rospy"],
)
def test_an_import_that_points_right_is_noticed(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = _source(tmp_path, monkeypatch, line)

    assert len(wrong_imports(file)) == 1


def _source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> Path:
    """A file of the room `master` in a source tree of its own."""
    (tmp_path / "rospy").mkdir()
    file = tmp_path / "pipros" / "master" / "bad.py"
    file.parent.mkdir(parents=True)
    file.write_text(text)
    monkeypatch.setattr(f"{__name__}.SRC", tmp_path)
    monkeypatch.setattr(f"{__name__}.REPOSITORY", tmp_path)
    return file

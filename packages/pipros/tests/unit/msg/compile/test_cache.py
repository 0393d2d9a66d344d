"""Compiled types on disk: used if valid, ignored if not, never a cause of errors."""

import ast
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import CodeType

import pytest

from pipros.msg.compile import cache
from pipros.msg.compile.cache import CompiledTypes
from pipros.msg.importing.library import Library
from pipros.msg.language.definition_files import DefinitionFiles


class Place:
    """Packages in a folder, a cache, and type libraries like those of new processes."""

    def __init__(self, folder: Path) -> None:
        self.packages = folder / "src"
        self.cache = folder / "cache"
        self.write("robot/msg/Arm.msg", "Hand left\nother/Tool tool\n")
        self.write("robot/msg/Hand.msg", "int8 fingers\n")
        self.write("other/msg/Tool.msg", "string name\n")

    def write(self, path: str, text: str) -> None:
        file = self.packages / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def find(self, package: str) -> str | None:
        folder = self.packages / package
        return str(folder) if folder.is_dir() else None

    def code(self) -> tuple[CodeType, Mapping[str, str]]:
        return Library(self.find, str(self.cache)).code("msg", "robot/Arm")

    def cached(self, compiler: Sequence[str] = cache._COMPILER) -> tuple[CodeType, Mapping[str, str]] | None:
        return CompiledTypes(str(self.cache), DefinitionFiles(self.find), compiler).get("msg", "robot/Arm")

    def entry(self) -> Path:
        (entry,) = self.cache.glob("robot.Arm.msg.*")
        return entry


@pytest.fixture
def place(tmp_path: Path) -> Place:
    return Place(tmp_path)


def test_a_compiled_type_is_found_by_the_next_process(place: Place) -> None:
    compiled = place.code()
    assert place.cached() == compiled
    assert set(compiled[1]) == {"robot/Hand", "other/Tool"}


@pytest.mark.parametrize("change", [
    lambda place: place.write("robot/msg/Arm.msg", "Hand left\nother/Tool t\n"),
    lambda place: place.write("other/msg/Tool.msg", "string title\n"),
    lambda place: (place.packages / "robot/msg/Hand.msg").unlink(),
    lambda place: os.utime(place.packages / "robot/msg/Hand.msg", ns=(0, 0)),
], ids=["itself", "what it embeds", "what it embeds is gone", "time"])  # fmt: skip
def test_a_changed_definition_is_noticed(place: Place, change: Callable[[Place], object]) -> None:
    place.code()
    change(place)
    assert place.cached() is None


def test_another_package_in_front_is_noticed(place: Place, tmp_path: Path) -> None:
    place.code()
    place.write("overlay/msg/Tool.msg", "string name\n")
    place.find = lambda package: str(place.packages / {"other": "overlay"}.get(package, package))  # type: ignore[method-assign]
    assert place.cached() is None


def test_another_compiler_is_noticed(place: Place) -> None:
    place.code()
    assert place.cached(compiler=("base.py",)) is None


def test_a_change_of_any_file_that_makes_or_serves_compiled_types_is_noticed() -> None:
    needed = imported_from("language/parse.py") | imported_from("compile/compiler.py")
    needed |= imported_from("compile/runtime.py")
    assert {"compile/decode.py", "compile/arrays.py"} < needed
    assert needed <= set(cache._COMPILER)


def imported_from(name: str) -> set[str]:
    """Return the file of that name in `pipros.msg`, and the files there that it imports eagerly."""
    found: set[str] = set()
    new = {name}
    while new:
        name = new.pop()
        found.add(name)
        for node in ast.parse((Path(cache.__file__).parents[1] / name).read_text()).body:
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("pipros.msg."):
                new |= {node.module.removeprefix("pipros.msg.").replace(".", "/") + ".py"} - found
    return found


@pytest.mark.parametrize("content", [b"", b"rubbish", b"pipros message 1\n", None])
def test_a_broken_entry_is_replaced(place: Place, content: bytes | None) -> None:
    compiled = place.code()
    whole = place.entry().read_bytes()
    place.entry().write_bytes(whole[:-5] if content is None else content)
    assert place.cached() is None
    assert place.code()[1] == compiled[1]
    assert place.cached() is not None


def test_an_unwritable_cache_is_skipped(place: Place) -> None:
    place.cache.write_text("a file where a folder should be")
    assert set(place.code()[1]) == {"robot/Hand", "other/Tool"}


def test_a_full_disk_leaves_nothing_behind(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(source: str, target: str, **_folders: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    place.code()
    assert [path for path in place.cache.rglob("*") if path.is_file()] == []


@pytest.mark.needs("file owners")
@pytest.mark.skipif(not hasattr(os, "getuid"), reason="files have no owner here")
def test_files_of_another_user_are_not_run(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    place.code()
    stranger = os.getuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: stranger)
    assert place.cached() is None


def test_many_may_write_at_once(place: Place) -> None:
    with ThreadPoolExecutor(8) as threads:
        list(threads.map(lambda _: place.code(), range(8)))
    assert place.cached() is not None


def test_without_a_folder_nothing_is_kept(place: Place) -> None:
    Library(place.find, None).code("msg", "robot/Arm")
    assert not place.cache.exists()

"""The included packages are ROS packages in every respect."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.importing.hook import installed_library
from pipros_workspace.index import SHIPPED_FOLDERS

WITH_DEFINITIONS = sorted(
    folder
    for share in SHIPPED_FOLDERS
    for folder in share.iterdir()
    if any((folder / kind).is_dir() for kind in ("msg", "srv"))
)


@pytest.mark.parametrize("folder", WITH_DEFINITIONS, ids=lambda folder: folder.name)
def test_an_included_package_declares_all_its_dependencies(folder: Path) -> None:
    texts = [file.read_text() for kind in ("msg", "srv", "action") for file in folder.glob(f"{kind}/*")]
    used = set(re.findall(r"^(\w+)/\w+", "\n".join(texts), re.MULTILINE))
    manifest = (folder / "package.xml").read_text()
    depends = re.findall(r"<depend>(\w+)</depend>", manifest)
    cmake = (folder / "CMakeLists.txt").read_text()

    assert used - {folder.name} <= set(depends)
    assert f"project({folder.name})\n" in cmake
    assert f"generate_messages({' '.join(['DEPENDENCIES', *depends] if depends else [])})\n" in cmake
    for kind, function in (("msg", "message"), ("srv", "service"), ("action", "action")):
        assert (f"add_{function}_files(DIRECTORY {kind})" in cmake) == (folder / kind).is_dir()


@pytest.mark.parametrize("package", ["", "..", "/etc"])
def test_an_invalid_package_name_is_not_treated_as_a_folder(package: str) -> None:
    with pytest.raises(NotFound, match="there is no package"):
        installed_library().files.file("msg", f"{package}/String")

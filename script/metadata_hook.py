"""Adds to the metadata: the addresses of the repository, absolute links, and what rooms declare.

`[tool.hatch.metadata.hooks.custom] repository` in pyproject.toml has the address. If it is empty, there are
no addresses, and all links are relative. The plugin hatch-fancy-pypi-readme can only insert a fixed address.

`scripts` and `extras` there belong to no room; see `pipros.basics.rooms`. A package of `packages` lists in
`dynamic` what it has from the pyproject.toml of the repository.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hatchling.metadata.core import load_toml
from hatchling.metadata.plugin.interface import MetadataHookInterface

_LINK = re.compile(r"(?P<picture>!?)\[(?P<text>[^\]\[]*)\]\((?P<path>(?![a-z]+:|#)[^)\s]+)\)")


def addresses(repository: str) -> dict[str, str]:
    """Return the links that PyPI shows beside the description."""
    return {
        "Documentation": f"{repository}/blob/main/docs/choose.md",
        "Source": repository,
        "Changelog": f"{repository}/blob/main/CHANGELOG.md",
        "Issues": f"{repository}/issues",
    }


def with_absolute_links(text: str, repository: str, tag: str) -> str:
    """Make relative links and picture paths in Markdown refer to a tag in the repository."""

    def absolute(found: re.Match[str]) -> str:
        kind = "raw" if found["picture"] else "blob"
        return f"{found['picture']}[{found['text']}]({repository}/{kind}/{tag}/{found['path']})"

    return _LINK.sub(absolute, text)


def without_absent(requirement: str, extras: Mapping[str, Any]) -> str:
    """Remove extras that the build lacks from a requirement such as `pipros[lz4,vision]`."""
    name, bracket, listed = requirement.partition("[")
    if name != "pipros":
        return requirement
    return f"{name}{bracket}{','.join(each for each in listed[:-1].split(',') if each in extras)}]"


class AddressHook(MetadataHookInterface):
    def update(self, metadata: dict[str, Any]) -> None:
        if str(Path(__file__).parent) not in sys.path:
            sys.path.insert(0, str(Path(__file__).parent))
        from build_rooms import packages_needed, repository_of, rooms_of_build

        folder, root = Path(self.root), repository_of(Path(self.root))
        settings = load_toml(str(root / "pyproject.toml"))
        project, config = settings["project"], settings["tool"]["hatch"]["metadata"]["hooks"]["custom"]
        if folder != root:
            metadata.update({field: project[field] for field in metadata["dynamic"] if field in project})
        repository = str(config.get("repository", "")).rstrip("/")
        if repository:
            metadata["urls"] = addresses(repository)
        rooms = rooms_of_build(self.root)
        scripts, extras = rooms.scripts(), rooms.extras()
        known = {**config["extras"], **extras}
        if metadata["name"] == "pipros":
            text = Path(root, "README.md").read_text(encoding="utf-8")
            if repository:
                text = with_absolute_links(text, repository, f"v{metadata['version']}")
            metadata["readme"] = {"content-type": "text/markdown", "text": text}
            scripts, extras = {**config["scripts"], **scripts}, known
        metadata["scripts"] = scripts
        metadata["optional-dependencies"] = {
            name: [without_absent(each, known) for each in needed] for name, needed in extras.items()
        }
        if folder != root:
            others = [f"{name}=={metadata['version']}" for name in packages_needed(folder, rooms)]
            own = project["dependencies"] if metadata["name"] == "pipros" else []
            metadata["dependencies"] = [*own, *others]

"""Adds to the metadata: the addresses of the repository, absolute links, and what rooms declare.

`[tool.hatch.metadata.hooks.custom] repository` in pyproject.toml has the address. If it is empty, there are
no addresses, and all links are relative. The plugin hatch-fancy-pypi-readme can only insert a fixed address.

`scripts` and `extras` there belong to no room; see `pipros.basics.rooms`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

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
        repository = str(self.config.get("repository", "")).rstrip("/")
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        if repository:
            text = with_absolute_links(text, repository, f"v{metadata['version']}")
            metadata["urls"] = addresses(repository)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
        if str(Path(self.root, "script")) not in sys.path:
            sys.path.insert(0, str(Path(self.root, "script")))
        from build_rooms import rooms_of_build

        rooms = rooms_of_build(self.root)
        metadata["scripts"] = {**self.config["scripts"], **rooms.scripts()}
        extras = {**self.config["extras"], **rooms.extras()}
        metadata["optional-dependencies"] = {
            name: [without_absent(each, extras) for each in needed] for name, needed in extras.items()
        }

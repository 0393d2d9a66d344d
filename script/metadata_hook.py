"""Adds the addresses of the repository to the metadata: `[project.urls]`, and absolute links in the README.

`[tool.hatch.metadata.hooks.custom] repository` in pyproject.toml has the address. If it is empty, there are
no addresses, and all links are relative. The plugin hatch-fancy-pypi-readme can only insert a fixed address.
"""

from __future__ import annotations

import re
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
    """Replace relative links and pictures in Markdown by those of a tag in the repository."""

    def absolute(found: re.Match[str]) -> str:
        kind = "raw" if found["picture"] else "blob"
        return f"{found['picture']}[{found['text']}]({repository}/{kind}/{tag}/{found['path']})"

    return _LINK.sub(absolute, text)


class AddressHook(MetadataHookInterface):
    def update(self, metadata: dict[str, Any]) -> None:
        repository = str(self.config.get("repository", "")).rstrip("/")
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        if repository:
            text = with_absolute_links(text, repository, f"v{metadata['version']}")
            metadata["urls"] = addresses(repository)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}

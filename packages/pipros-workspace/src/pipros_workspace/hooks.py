"""Environment hooks: files that packages provide and that a workspace's setup files source."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

HOOKS_FOLDER = Path("etc", "catkin", "profile.d")

_GENERIC = "sh"
_POSIX_SHELLS = ("sh", "bash", "zsh")


@dataclass(frozen=True, slots=True)
class FoundHook:
    """A hook and the devel or install space that contains it."""

    workspace: Path
    file: Path


def find_hooks(workspaces: Sequence[Path], shell: str) -> list[FoundHook]:
    """Return a shell's hooks in Noetic's order: `.sh` before shell-specific hooks, underlays before overlays.

    If several workspaces have a hook with the same name, only the hook of the topmost workspace is returned.

    Args:
        workspaces: the workspaces, topmost first.
    """
    kinds = [_GENERIC] if shell in _POSIX_SHELLS else []
    if shell != _GENERIC:
        kinds.append(shell)
    found: list[FoundHook] = []
    for kind in kinds:
        by_name: dict[str, FoundHook] = {}
        for workspace in reversed(workspaces):
            for file in sorted((workspace / HOOKS_FOLDER).glob(f"*.{kind}")):
                by_name.pop(file.name, None)
                by_name[file.name] = FoundHook(workspace, file)
        found += by_name.values()
    return found

"""Choose the wheels in the folders that a user names, so that exactly these files are installed.

pip would take a higher version from an index, where anyone can publish one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from pipros.wheels.index import BadWheel, IndexedWheel, read_wheel, read_wheel_name, version_key
from pipros.wheels.names import normalized

_REQUIREMENT = re.compile(
    r"\s*([A-Za-z0-9][\w.-]*)\s*(?:\(([^)]*)\)|([^;\[@]*))\s*(.*)", re.ASCII | re.DOTALL
)
_BOUND = re.compile(r"\s*(==|!=|<=|>=|<|>)\s*([\w.!+-]+)\s*", re.ASCII)
_UNIVERSAL = re.compile(r"-(?:py2\.)?py3-none-any\.whl\Z")


def split_requirement(text: str) -> tuple[str, str | None]:
    """Return the normalized name and the version limits in a requirement such as `pyserial>=3.5`.

    The limits are None if only pip can decide: with extras, a URL, a marker or operators such as `~=`.
    """
    found = _REQUIREMENT.fullmatch(text)
    if found is None:
        return normalized(text.strip()), None
    bounds = (found[2] or found[3] or "").strip()
    is_simple = not found[4].strip() and all(map(_BOUND.fullmatch, filter(None, bounds.split(","))))
    return normalized(found[1]), bounds if is_simple else None


class FolderWheels:
    """The wheels in some folders that suit every platform. Other wheels are left to pip."""

    def __init__(self, folders: Sequence[Path], errors: list[str]) -> None:
        """List the folders; each wheel is read when it is needed.

        Args:
            errors: receives the reason for each needed file that is not a valid wheel.
        """
        self._errors = errors
        self._files: dict[str, dict[Path, str]] = {}
        for folder in folders:
            for file in sorted(folder.glob("*.whl")):
                if _UNIVERSAL.search(file.name):
                    try:
                        name, version = read_wheel_name(file.name)
                    except BadWheel:
                        continue
                    self._files.setdefault(name, {})[file] = version

    def find(self, distribution: str, bounds: str) -> IndexedWheel | None:
        """Return the newest wheel of a distribution within version limits, or None.

        A pre-release is only returned if there is no other version.
        """
        files = self._files.get(distribution, {})
        for file in sorted(files, key=lambda file: _preference(files[file]), reverse=True):
            if _fits(files[file], bounds):
                try:
                    return read_wheel(file)
                except (BadWheel, OSError) as error:
                    self._errors.append(str(error))
                    del files[file]
                    return self.find(distribution, bounds)
        return None


def _preference(version: str) -> tuple[int, tuple[int, ...], str]:
    release, is_final, rest = version_key(version)
    return is_final, release, rest


def _fits(version: str, bounds: str) -> bool:
    key = version_key(version)
    for bound in _BOUND.finditer(bounds):
        limit = version_key(bound[2])
        if not {
            "==": key == limit,
            "!=": key != limit,
            "<": key < limit,
            "<=": key <= limit,
            ">": key > limit,
            ">=": key >= limit,
        }[bound[1]]:
            return False
    return True

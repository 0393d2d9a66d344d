"""Choose the wheels in the folders that a user names, so that exactly these files are installed.

pip would take a higher version from an index, where anyone can publish one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from pipros_wheels.index import BadWheel, IndexedWheel, read_wheel, read_wheel_name, version_key
from pipros_wheels.names import normalized

_REQUIREMENT = re.compile(
    r"\s*([A-Za-z0-9][\w.-]*)\s*(?:\(([^)]*)\)|([^;\[@]*))\s*(.*)", re.ASCII | re.DOTALL
)
_BOUND = re.compile(r"\s*(===|==|!=|<=|>=|~=|<|>)\s*([\w.!+-]+?)(\.\*)?\s*", re.ASCII)
_UNIVERSAL = re.compile(r"-(?:py2\.)?py3-none-any\.whl\Z")


def split_requirement(text: str) -> tuple[str, str, bool]:
    """Return the normalized name and the version limits in a requirement such as `pyserial>=3.5`.

    The third value is false if only pip can decide: with extras, a URL, a marker or an unknown operator.
    """
    found = _REQUIREMENT.fullmatch(text)
    if found is None:
        return normalized(text.strip()), "", False
    bounds = ",".join(filter(None, map(str.strip, (found[2] or found[3] or "").split(","))))
    is_simple = not found[4].strip() and all(map(_BOUND.fullmatch, filter(None, bounds.split(","))))
    return normalized(found[1]), bounds, is_simple


class FolderWheels:
    """The wheels in some folders that suit every platform. Other wheels are left to pip."""

    def __init__(self, folders: Sequence[Path], errors: list[str]) -> None:
        """List the folders; each wheel is read when it is needed.

        Args:
            errors: receives the reason for each needed file that is not a valid wheel.
        """
        self._errors = errors
        self._read = cache(read_wheel)
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
            if fits(files[file], bounds):
                try:
                    return self._read(file)
                except (BadWheel, OSError) as error:
                    self._errors.append(str(error))
                    del files[file]
                    return self.find(distribution, bounds)
        return None


def _preference(version: str) -> tuple[int, tuple[int, ...], str]:
    release, is_final, rest = version_key(version)
    return is_final, release, rest


def fits(version: str, limits: str) -> bool:
    """Return whether a version is within limits such as `>=1.2,<2`, with the operators of PEP 440.

    No version is within limits that are not valid.
    """
    return all(_is_within(version, _BOUND.fullmatch(limit)) for limit in limits.split(",") if limit.strip())


def _is_within(version: str, bound: re.Match[str] | None) -> bool:
    if bound is None:
        return False
    operator, text, is_prefix = bound.groups()
    key, limit = version_key(version), version_key(text)
    if is_prefix:  # `==1.2.*`
        return _begins_with(version, text) is (operator == "==")
    if operator == "~=":  # `~=1.2.3` is `>=1.2.3,==1.2.*`
        return key >= limit and _begins_with(version, text.rpartition(".")[0])
    return {
        "===": version == text,
        "==": key == limit,
        "!=": key != limit,
        "<": key < limit,
        "<=": key <= limit,
        ">": key > limit,
        ">=": key >= limit,
    }[operator]


def _begins_with(version: str, text: str) -> bool:
    """Return whether the release of a version begins with that of another, where 1 is 1.0."""
    parts = len(text.split("."))
    ours, other = version_key(version)[0], version_key(text)[0]
    return (*ours, *[0] * parts)[:parts] == (*other, *[0] * parts)[:parts]

"""Build backend for ROS packages, used by pip and uv (PEP 517 and 660).

`pyproject.toml` needs three lines, which `pipros wheel --init` writes. The settings `strict` and `whole`
(`--config-settings strict=true`) correspond to the options of `pipros wheel`.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipros_wheels.archive import ArchiveEntry, write_source_archive
from pipros_wheels.file_tree import WheelRefused, source_entries
from pipros_wheels.metadata import base_name, wheel_text
from pipros_wheels.package_reading import read_package
from pipros_wheels.wheel_build import (
    WheelOptions,
    build_wheels,
    metadata_of,
    source_packages,
    surroundings_of,
)
from pipros_workspace.layout import SourcePackage

Settings = Mapping[str, object] | None


def get_requires_for_build_wheel(config_settings: Settings = None) -> list[str]:
    """Return an empty list: a build needs only pipros."""
    return []


get_requires_for_build_editable = get_requires_for_build_wheel
get_requires_for_build_sdist = get_requires_for_build_wheel


def prepare_metadata_for_build_wheel(metadata_directory: str, config_settings: Settings = None) -> str:
    """Write the `.dist-info` folder of the wheel, and return its name."""
    package = _package()
    with tempfile.TemporaryDirectory(prefix="pipros-wheel-") as folder:
        project = read_package(package, Path(folder), surroundings_of([package]), lambda _name: (), _say)
        return _write_info(package, metadata_of(package, project, WheelOptions()), metadata_directory)


def prepare_metadata_for_build_editable(metadata_directory: str, config_settings: Settings = None) -> str:
    """Write the `.dist-info` folder of the editable wheel, and return its name."""
    package = _package()
    return _write_info(package, metadata_of(package, None, WheelOptions()), metadata_directory)


def build_wheel(
    wheel_directory: str, config_settings: Settings = None, metadata_directory: str | None = None
) -> str:
    """Build the wheel of the package in the working directory, and return the wheel's file name."""
    return _build(wheel_directory, config_settings, is_editable=False)


def build_editable(
    wheel_directory: str, config_settings: Settings = None, metadata_directory: str | None = None
) -> str:
    """Build a wheel that points to the working directory, and return the wheel's file name."""
    return _build(wheel_directory, config_settings, is_editable=True)


def build_sdist(sdist_directory: str, config_settings: Settings = None) -> str:
    """Write the source archive of the package in the working directory, and return its file name."""
    package = _package()
    base = base_name(package)
    entries = {f"{base}/{path}": entry for path, entry in source_entries(package.folder).items()}
    entries[f"{base}/PKG-INFO"] = ArchiveEntry(metadata_of(package, None, WheelOptions()).encode())
    file = Path(sdist_directory, f"{base}.tar.gz")
    write_source_archive(file, entries)
    return file.name


def _package() -> SourcePackage:
    folder = Path.cwd()
    if not (folder / "package.xml").is_file():
        raise WheelRefused(f"{folder} has no package.xml")
    space = source_packages([folder])
    _check(space.errors)
    (package,) = space.packages
    return package


def _check(errors: Sequence[str]) -> None:
    if errors:
        raise WheelRefused("\n".join(errors))


def _build(folder: str, settings: Settings, *, is_editable: bool) -> str:
    options = WheelOptions(
        is_strict=_is_on(settings, "strict"), is_whole=_is_on(settings, "whole"), is_editable=is_editable
    )
    build = build_wheels([_package()], Path(folder), options, _say)
    _check([*build.errors, *build.left_out])
    (wheel,) = build.wheels
    for note in wheel.notes:
        _say(f"{wheel.package.name}: {note}")
    for line in build.missing():
        _say(line)
    return wheel.file.name


def _write_info(package: SourcePackage, metadata: str, folder: str) -> str:
    name = f"{base_name(package)}.dist-info"
    info = Path(folder, name)
    shutil.rmtree(info, ignore_errors=True)
    info.mkdir(parents=True)
    for file, text in (("METADATA", metadata), ("WHEEL", wheel_text())):
        (info / file).write_bytes(text.encode())
    return name


def _is_on(settings: Settings, name: str) -> bool:
    value = str((settings or {}).get(name, "false")).lower()
    if value not in ("true", "false", "1", "0", ""):
        raise WheelRefused(f"the setting {name} must be true or false, got [{value}]")
    return value in ("true", "1", "")


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)

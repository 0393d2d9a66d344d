"""The part of ament_index_python that xacro 2 imports."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.packages import SHARE
from pipros.packages.ament_index_python.packages import PackageNotFoundError, get_package_share_directory


def test_shipped_packages_are_found() -> None:
    assert get_package_share_directory("std_msgs") == str(Path(SHARE, "std_msgs"))


def test_a_missing_package_is_an_error_that_names_it() -> None:
    with pytest.raises(PackageNotFoundError, match="there is no package no_such_package"):
        get_package_share_directory("no_such_package")

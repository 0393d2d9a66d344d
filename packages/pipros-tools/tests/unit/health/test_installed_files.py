"""Modules of pipros that another distribution replaced are found by the hashes that pip recorded."""

from __future__ import annotations

import base64
import hashlib
import sys
from pathlib import Path

import pytest

from pipros_tools.health.gather_machine import changed_packages

OURS = "pipros-of-test"


def install(folder: Path, name: str, modules: dict[str, str]) -> None:
    """Write modules and a record of them, as pip does."""
    rows = [f"../../bin/{name},,", "RECORD,,"]
    for module, text in modules.items():
        path = folder / module
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(text.encode())
        digest = base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).rstrip(b"=").decode()
        rows.append(f"{module},sha256={digest},{len(text)}")
    records = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    records.mkdir()
    (records / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (records / "RECORD").write_text("\n".join(rows) + "\n")


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    others = [folder for folder in sys.path if "site-packages" not in folder]  # pipros may be installed there
    monkeypatch.setattr(sys, "path", [str(tmp_path), *others])
    install(
        tmp_path, OURS, {"rospy/__init__.py": "ours\n", "rospy/core.py": "ours\n", "rosbag/bag.py": "ours\n"}
    )
    return tmp_path


def test_files_of_other_packages_are_ignored(site: Path) -> None:
    install(site, "bag-viewer", {"bag_viewer/__init__.py": "theirs\n"})
    assert changed_packages(OURS) == {}


def test_the_distribution_that_replaced_modules_is_named(site: Path) -> None:
    install(site, "old-messages", {"rospy/core.py": "theirs\n", "std_msgs/__init__.py": "theirs\n"})
    assert changed_packages(OURS) == {"rospy": "old-messages"}


def test_equal_modules_of_two_distributions_do_not_matter(site: Path) -> None:
    install(site, "same", {"rospy/core.py": "ours\n"})
    assert changed_packages(OURS) == {}


def test_a_deleted_module_has_no_owner(site: Path) -> None:
    (site / "rosbag" / "bag.py").unlink()
    assert changed_packages(OURS) == {"rosbag": ""}


def test_packages_not_installed_by_pip_are_not_examined() -> None:
    assert changed_packages("not-installed-at-all") == {}

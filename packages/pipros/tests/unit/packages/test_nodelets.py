from __future__ import annotations

import pytest

from pipros.packages.nodelets import package_of, python_nodelet, shipped_nodelets
from pipros_libraries.nodelets.hosting import CannotLoad, class_of


@pytest.mark.parametrize("plugin", shipped_nodelets())
def test_every_nodelet_can_be_imported(plugin: str) -> None:
    assert callable(class_of(plugin))


def test_nodelets_that_cannot_be_imported_are_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    assert python_nodelet("my_package/Nothing") is None
    wrong = {"a/A": "pipros_libraries.nodelets.nothing:A", "a/B": "pipros_libraries.nodelets.hosting:Nothing"}
    monkeypatch.setattr("pipros.packages.nodelets.shipped_nodelets", lambda: wrong)
    for plugin in ("a/A", "a/B"):
        with pytest.raises(CannotLoad, match=f"of {plugin} cannot be imported"):
            class_of(plugin)


def test_prefixes_name_packages() -> None:
    assert [package_of(each) for each in ("pcl/VoxelGrid", "image_proc/rectify")] == ["pcl_ros", "image_proc"]

"""Names of bags that a browser may open."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipros_page.bags import folder
from pipros_page.bags.folder import BadBagName, BagFolder


def test_bags_in_subfolders_are_listed_and_links_out_are_not(tmp_path: Path) -> None:
    inside, outside = tmp_path / "bags", tmp_path / "outside.bag"
    (inside / "day").mkdir(parents=True)
    for path in (outside, inside / "day" / "run.bag", inside / "open.bag.active", inside / "notes.txt"):
        path.write_bytes(b"12345")
    (inside / "link.bag").symlink_to(outside)
    (inside / "same.bag").symlink_to(inside / "day" / "run.bag")
    (inside / "up").symlink_to(tmp_path)
    (inside / "loop.bag").symlink_to("loop.bag")
    assert dict(BagFolder(inside).names()) == {"day/run.bag": 5, "open.bag.active": 5, "same.bag": 5}


def test_the_newest_bags_are_listed_whichever_folder_is_read_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folder, "MAX_FILES", 1)
    for number in range(4):
        day = tmp_path / f"day{number}"
        day.mkdir()
        (day / "run.bag").write_bytes(b"1")
        os.utime(day / "run.bag", (0, 0))
    last_read = os.listdir(tmp_path)[-1]
    os.utime(tmp_path / last_read / "run.bag")
    assert [name for name, _ in BagFolder(tmp_path).names()] == [f"{last_read}/run.bag"]


@pytest.mark.parametrize(("name", "says"), [
    ("../outside.bag", "is outside the bag folder"), ("link.bag", "is outside the bag folder"),
    ("up/outside.bag", "is outside the bag folder"), ("/etc/passwd", "must end in"),
    ("/etc/x.bag", "is outside the bag folder"), ("missing.bag", "there is no bag"),
    ("loop.bag", "there is no bag"), ("a\0.bag", "null character"), (7, "must end in"),
])  # fmt: skip
def test_names_that_lead_out_of_the_folder_are_refused(tmp_path: Path, name: object, says: str) -> None:
    inside = tmp_path / "bags"
    inside.mkdir()
    (tmp_path / "outside.bag").write_bytes(b"")
    (inside / "link.bag").symlink_to(tmp_path / "outside.bag")
    (inside / "up").symlink_to(tmp_path)
    (inside / "loop.bag").symlink_to("loop.bag")
    with pytest.raises(BadBagName, match=says):
        BagFolder(inside).find(name)

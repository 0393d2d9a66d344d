"""Every attribute of every element of launch files, and every element in every other, against genuine."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros_tools.launch.model import LaunchError
from tests.support.ros import RosSystem
from tests.unit.launch.test_xml_as_genuine import FOLDER, described, load_case, sorted_text

ELEMENTS = {
    "node": {"pkg": "p", "type": "t", "name": "n"},
    "test": {"pkg": "p", "type": "t", "test-name": "n"},
    "param": {"name": "a", "value": "1"},
    "rosparam": {"param": "k"},
    "remap": {"from": "a", "to": "b"},
    "env": {"name": "A", "value": "b"},
    "arg": {"name": "z", "default": "1"},
    "machine": {"name": "m", "address": "h"},
    "include": {"file": "$(dirname)/plain.launch"},
    "group": {"ns": "g"},
    "master": {},
}
NODE = "pkg type machine name args output respawn respawn_delay cwd ns clear_params launch-prefix required"
ATTRIBUTES = {
    "node": NODE,
    "test": f"{NODE} test-name time-limit retry",
    "param": "name value type textfile binfile command",
    "rosparam": "command ns file param subst_value",
    "remap": "from to",
    "env": "name value",
    "arg": "name value default doc",
    "machine": "name address env-loader ssh-port user password default timeout ros-root ros-ip ros-hostname",
    "include": "file ns clear_params pass_all_args",
    "group": "ns clear_params",
    "master": "auto uri",
}
VALUES = ("", " ", "x", "2", "-1", "TRUE", "/a", "$(arg u)")

BETTER = {
    '<rosparam param="k" command="dump" file="">': "an empty file is no file",
    '<machine name="m" address="h" ssh-port="-1">': "no port has this number",
}
"""Starts of cases in which pipros differs on purpose."""


def element(tag: str, attributes: dict[str, str], inside: str = "") -> str:
    written = "".join(f' {name}="{value}"' for name, value in attributes.items())
    return f"<{tag}{written}>{'{a: 1}' if tag == 'rosparam' else ''}{inside}</{tag}>"


def cases() -> Iterator[str]:
    for tag, base in ELEMENTS.items():
        for name in (*ATTRIBUTES[tag].split(), "if", "unless", "unknown"):
            for value in VALUES:
                yield element(tag, {**base, name: value})
                if tag == "param":
                    yield element(tag, {"name": "a", name: value})
                if tag == "rosparam":
                    yield element(tag, {**base, "command": "delete", name: value})
                    yield element(tag, {**base, "command": "dump", name: value})
        for name in base:
            yield element(tag, {key: value for key, value in base.items() if key != name})
        yield element(tag, base) * 2
        yield element(tag.upper(), base)
        for outer, attributes in ELEMENTS.items():
            for inner in (tag, tag.capitalize(), "launch", "unknown"):
                yield element(outer, attributes, element(inner, base))
            yield element(outer, attributes, element(tag, base) * 2)


@pytest.mark.timeout(300)
def test_every_attribute_and_every_nesting_has_the_outcome_of_genuine_roslaunch(
    ros: RosSystem, tmp_path: Path
) -> None:
    folder = tmp_path / "files"
    shutil.copytree(FOLDER / "files", folder)
    (tmp_path / "cases.txt").write_text("".join(f"{case}\n" for case in dict.fromkeys(cases())))
    script = Path(__file__).parent / "programs" / "genuine_launch_loader.py"

    ended = ros.genuine.run(
        "python3", script, tmp_path / "cases.txt", folder, ROS_PACKAGE_PATH="/usr/share", timeout_s=240
    )

    rows = [json.loads(line) for line in ended.stdout]
    assert len(rows) > 1500
    differing = {}
    for case, genuine in ((row["case"], row["genuine"]) for row in rows):
        if case.startswith(tuple(BETTER)):
            continue
        try:
            launch = load_case(case, folder)
        except LaunchError as error:
            ours = f"refused: {error.reason}"
            is_same = "error" in genuine
        else:
            warned = genuine.pop("warnings", 0)
            ours = json.dumps(described(launch)).replace(str(folder), "{folder}")
            is_same = sorted_text(json.loads(ours)) == sorted_text(genuine) and len(launch.warnings) >= warned
        if not is_same:
            differing[case] = ours, genuine
    assert differing == {}

"""The walk of docs/guides/ros2.md (`pipros wheel --ros2`, …), with ROS 2 in its own environment, and in ours.

`script/long ros2` walks with Kilted in place of Jazzy.

# needs the plugins: wheels
"""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import documents
from tests.support.dds_peers import enable_multicast
from tests.support.environments import EXAMPLES, VENV_BIN
from tests.support.network import LoneNetwork, needs_network
from tests.support.processes import Process, Processes
from tests.support.ros2_wheels import environment
from tests.support.shared_ros2 import shared_environment

pytestmark = needs_network
DOCUMENT = documents.text_of("guides/ros2.md")
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)
ENDLESS = ("roslaunch", "rosrun")
DISTRO = os.environ.get("PIPROS_TEST_WALK", "jazzy")
DOMAIN = "61"
"""Networks have the shared memory of Fast DDS in common, whose files the domain names."""


class Reader:
    """Types what the walk says, in a network of their own. The last endless program keeps running."""

    def __init__(self, home: Path, network: LoneNetwork) -> None:
        self._network = network
        self.home = home
        self._launched: Process | None = None
        self.processes = Processes(
            {
                "PATH": f"{VENV_BIN}:/usr/bin:/bin",
                "HOME": str(home),
                "ROS_MASTER_URI": "http://localhost:11311",
                "ROS_IP": "127.0.0.1",
                "ROS_PACKAGE_PATH": f"{home}/moving:{EXAMPLES}",
                "ROS_DOMAIN_ID": DOMAIN,
                # instead of the index that has ROS 2's wheels, all of which are installed
                "PIP_NO_DEPS": "1",
                "PIP_NO_INDEX": "1",
            },
            home,
        )

    def read(self, text: str) -> None:
        for language, title, content in BLOCK.findall(text):
            if title:
                (self.home / title.removeprefix("~/")).write_text(content)
            elif language == "bash":
                for part in re.split(r"^\$ ", content, flags=re.MULTILINE)[1:]:
                    line, _, expected = part.partition("\n")
                    self.type(line, expected)

    def type(self, line: str, expected: str) -> None:
        if line.startswith("roslaunch") and self._launched is not None:
            self._launched.press_ctrl_c()
            self._launched.wait()
        folder = self.home / "moving"
        process = self.processes.start(
            *self._network.command("/bin/bash", "-c", f"exec {line}" if line.startswith(ENDLESS) else line),
            cwd=folder if folder.is_dir() else self.home,
        )
        for wanted in expected.splitlines():
            if wanted != "...":
                process.wait_for(re.escape(wanted).replace(r"\.\.\.", ".*"), 200)
        if line.startswith("roslaunch"):
            self._launched = process
        elif line.startswith(ENDLESS):
            process.press_ctrl_c()
            process.wait()
        else:
            assert process.wait(200) == 0, process.output


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reader]:
    home = tmp_path_factory.mktemp("walk")
    genuine = environment(DISTRO)
    option = "-al" if genuine.stat().st_dev == home.stat().st_dev else "-a"
    subprocess.run(["cp", option, genuine, home / DISTRO], check=True)
    python = home / DISTRO / "bin" / "python"
    pip = home / DISTRO / "bin" / "pip"
    pip.write_text(f'#!/bin/sh\nexec {sys.executable} -m pip --python {python} "$@"\n')
    pip.chmod(0o755)
    cache = home / ".ros" / "pipros"
    cache.mkdir(parents=True)
    (cache / f"ros2_{DISTRO}_{sys.implementation.cache_tag}").symlink_to(genuine)
    network = LoneNetwork("127.0.0.1 localhost\n")
    enable_multicast(network)
    made = Reader(home, network)
    try:
        yield made
    finally:
        made.processes.end_all()
        network.close()


@pytest.mark.timeout(600)
def test_three_nodes_move_one_by_one_then_into_one_environment(reader: Reader) -> None:
    walk = DOCUMENT.partition("\n## Moving node by node")[2].partition("\n## ")[0].replace("jazzy", DISTRO)
    assert len(BLOCK.findall(walk)) == 8
    reader.read(walk)
    assert (reader.home / "moving" / "moved_ros2" / "metadata.yaml").is_file()

    programs = shared_environment(DISTRO, reader.home / "env")
    wheels = sorted((reader.home / "moving" / "dist").glob("*.whl"))
    pip = (sys.executable, "-m", "pip", "--python", programs / "python", "install", "--no-deps", "--no-index")
    subprocess.run(
        [*pip, *wheels], check=True, capture_output=True, env={**os.environ, "PIP_CONFIG_FILE": os.devnull}
    )
    line = "roslaunch moved all.launch listener:=moved talker:=moved ros2_python:="
    reader.type(f"{line}{programs}/python", "... [listener]: Battery level of vehicle: %25\n")

"""pipros 0.3.0, which knows only TCP, at either end of a topic that newer nodes share over all transports.

Not collected by `script/test`, because it installs that release; `script/long local` runs it.
"""

import io
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from tests.interop.test_shared_topics_of_one_machine import PUBLISH, SUBSCRIBE, transports
from tests.support.environments import REPOSITORY
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

ROOT = REPOSITORY
RELEASE = "b95bff2d"
pytestmark = pytest.mark.timeout(600)


@pytest.fixture
def old_python(tmp_path: Path) -> Path:
    """Return the interpreter of an environment with pipros 0.3.0."""
    archive = subprocess.run(["git", "archive", RELEASE], cwd=ROOT, capture_output=True, check=True)
    with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as files:
        files.extractall(tmp_path / "source")  # noqa: S202 # from this repository
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", tmp_path / "source"], check=True)
    return python


def test_an_older_release_shares_a_topic_with_nodes_that_use_memory(ros: RosSystem, old_python: Path) -> None:
    ros.serve_master()
    publish, subscribe = ros.home / "publish.py", ros.home / "subscribe.py"
    publish.write_text(PUBLISH)
    subscribe.write_text(SUBSCRIBE)
    subscribers = [
        ros.pipros.start(old_python, subscribe, "to_old"), ros.pipros.start("python", subscribe, "to_new"),
        ros.pipros.start("python", subscribe, "to_views", "zero_copy"),
        ros.genuine.start("/usr/bin/python3", subscribe, "to_rospy"),
    ]  # fmt: skip
    for name in ("/to_old", "/to_new", "/to_views", "/to_rospy"):
        wait_until(lambda: name in ros.subscribers("/images"), 60, name)  # noqa: B023
    ros.pipros.start(old_python, publish, "by_old", "images")
    ros.pipros.start("python", publish, "by_new", "images")
    for subscriber in subscribers:
        for name in ("by_old", "by_new"):
            subscriber.wait_for(f"^intact {name}$", timeout_s=120)
        assert "WRONG" not in subscriber.output
    assert transports(ros, "/by_new") == 2 * ["PIPROSLOCAL"] + 2 * ["TCPROS"]
    assert (transports(ros, "/by_old"), transports(ros, "/to_old")) == (4 * ["TCPROS"], 2 * ["TCPROS"])
    assert "    * shared memory: " in ros.pipros.run("rosnode", "info", "by_new").output

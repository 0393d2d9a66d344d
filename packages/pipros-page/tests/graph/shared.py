"""A system that the tests of a file share, each of which only looks at what runs in it."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem


@pytest.fixture(scope="module")
def shared_ros(tmp_path_factory: pytest.TempPathFactory, bare_tools: Path) -> Iterator[RosSystem]:
    """A system like that of the fixture `ros`, with what a fixture of the file starts in it."""
    port = ClaimedPort()
    system = RosSystem(port.number, tmp_path_factory.mktemp("shared"), bare_tools)
    yield system
    system.close()
    port.release()

from pathlib import Path

import pytest

from tests.support.definitions import Packages


@pytest.fixture
def packages(tmp_path: Path) -> Packages:
    return Packages(tmp_path)

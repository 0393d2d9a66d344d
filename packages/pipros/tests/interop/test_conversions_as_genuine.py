"""tf_conversions of pipros and of genuine ROS, with Debian's PyKDL."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.support.same_results import is_near

PROGRAM = Path(__file__).parent / "programs" / "examine_conversions.py"
PYKDL = next(Path("/usr/lib/python3/dist-packages").glob("PyKDL.cpython*.so"))


def asked(python: str, **variables: str) -> Any:
    ended = subprocess.run(
        [python, PROGRAM, "1"],
        env={"PATH": "/usr/bin:/bin", **variables},
        check=True,
        capture_output=True,
        text=True,
    )
    return json.loads(ended.stdout)


def test_poses_are_converted_alike(tmp_path: Path) -> None:
    if f"cpython-{sys.version_info.major}{sys.version_info.minor}-" not in PYKDL.name:
        program = "import tf_conversions; tf_conversions.Frame"
        refused = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
        assert "needs PyKDL" in refused.stderr
        return
    (tmp_path / PYKDL.name).symlink_to(PYKDL)

    genuine, ours = asked("/usr/bin/python3"), asked(sys.executable, PYTHONPATH=str(tmp_path))

    assert is_near(ours[0], genuine[0])
    assert set(genuine[1]) - set(ours[1]) == set()

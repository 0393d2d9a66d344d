"""`sensor_msgs.point_cloud2` of pipros and of genuine ROS, on the same clouds."""

from __future__ import annotations

import json
import subprocess

from tests.interop.programs.examine_clouds import __file__ as script
from tests.interop.programs.examine_clouds import examine_many


def test_random_clouds_hold_the_same_points() -> None:
    asked = subprocess.run(
        ["/usr/bin/python3", script], env={"PATH": "/usr/bin:/bin"}, capture_output=True, check=True
    )

    assert examine_many(seed=1, count=300) == json.loads(asked.stdout)

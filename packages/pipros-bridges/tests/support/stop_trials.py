"""Trials of the guardian: how long a robot that holds its last command drives on after each accident.

`python -m tests.support.stop_trials [--trials 100] [--only client,server,…] [--without-guardian]` prints the
median, the 99th percentile and the maximum, and exits with 1 if a robot was not stopped. The times begin with
the accident; if a server hangs, a client is silent, a link is cut or the clock jumps, they include the limit
of 0.5 s. Without a guardian (no time limit in the policy), robots drive on. `script/long stop` runs both.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Final

from pipros.master.master import Master
from tests.support.stop_accidents import ACCIDENTS, ENDING, LONGEST_S, Robot, Serving

LIMIT_S: Final = 0.5
POLICY: Final = """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {linear.x: {range: [-0.3, 0.3], unit: m/s}}
"""


class Trials:
    """The trials with one policy."""

    def __init__(self, robot: Robot, policy: Path, master_uri: str) -> None:
        self._robot = robot
        self._policy = policy
        self._master_uri = master_uri

    def run(self, name: str, count: int, longest_s: float) -> list[float | None]:
        """Return the times (s) from an accident to the stop; None for a robot that drove on."""
        serving: Serving | None = None
        found: list[float | None] = []
        try:
            for _ in range(count):
                serving = serving or Serving(self._master_uri, self._policy)
                self._robot.driven_s = 0.0
                with ACCIDENTS[name](serving, self._robot) as happened_s:
                    has_stopped = self._robot.stopped.wait(longest_s)
                    found.append(self._robot.stopped_s - happened_s if has_stopped else None)
                if name in ENDING:
                    serving.close()
                    serving = None
        finally:
            if serving is not None:
                serving.close()
        return found


def main() -> int:
    """Run the trials, and return the exit code."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--only", default=",".join(ACCIDENTS))
    parser.add_argument("--without-guardian", action="store_true")
    options = parser.parse_args()
    failed = 0
    with Master(port=0) as master, tempfile.TemporaryDirectory() as folder:
        os.environ["ROS_HOME"] = folder
        policy = Path(folder) / "policy.yaml"
        policy.write_text(POLICY + ("" if options.without_guardian else f"    time_limit_s: {LIMIT_S}\n"))
        robot = Robot(master.uri)
        trials = Trials(robot, policy, master.uri)
        for name in options.only.split(","):
            found = trials.run(name, options.trials, 3.0 if options.without_guardian else LONGEST_S)
            times = sorted(each for each in found if each is not None)
            failed += len(found) - len(times)
            text = f"{name:10} {len(times)} of {len(found)} stopped"
            if times:
                p99 = times[max(0, -(-len(times) * 99 // 100) - 1)]
                text += (
                    f", median {statistics.median(times):.3f} s, p99 {p99:.3f} s, longest {times[-1]:.3f} s"
                )
            print(text, flush=True)
        robot.close()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

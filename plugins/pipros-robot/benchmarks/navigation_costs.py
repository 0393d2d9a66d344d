#!/usr/bin/env python3
"""Processor time of move_base and amcl in a drive, by samples per command and rate.

    script/bench navigation_costs [--seconds 20] [--only 120x5,800x10]

The robot of pipros_sim drives through the apartment in lockstep, so that all commands are sent on a machine
of any speed, and the times are those of the processor per simulated second. The last columns are the rates
of commands that remain after costmaps and amcl: with half a core of this machine, and with a core that is
slower by the factor `SLOWER`, which is a guess for a Raspberry Pi 4 (`Pi 4?`).
"""

import psutil
from programs import QUIET, Programs, cpu_s
from table import options_of

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros_libraries.transforms.messages import in_ns
from pipros_robot.navigation import plane
from pipros_robot.navigation.world_parameters import PARAMETERS, merged
from pipros_workspace.index import SHARED_PACKAGES
from tests.support.waiting import wait_until

APARTMENT = str(SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml")
START, GOALS = (2.9, 1.0, 1.2), ((7.8, 1.5, 0.0), (7.4, 5.9, -0.8))
SAMPLES = {60: (3, 20), 120: (6, 20), 400: (20, 20), 800: (20, 40)}
"""Numbers of velocities and rates of turning, by samples per command."""
SLOWER = 3.5
ROWS = ((60, 5), (120, 5), (120, 10), (400, 10), (800, 10), (400, 20), (800, 20))


class Drive(Programs):
    """A simulated robot with amcl and move_base, in lockstep."""

    def __init__(self, samples, rate_hz):
        super().__init__()
        self.node = super().node()
        forwards, turns = SAMPLES[samples]
        planner = {"vx_samples": forwards, "vy_samples": 1, "vth_samples": turns}
        x, y, yaw = START
        own = {
            "use_sim_time": True,
            "lockstep": ["/amcl", "/move_base"],
            "sim": {"map": APARTMENT, "headless": True, "robots": [{"x": x, "y": y, "yaw": yaw}]},
            "amcl": {**PARAMETERS["amcl"], "initial_pose_x": x, "initial_pose_y": y, "initial_pose_a": yaw},
            "move_base": merged(
                PARAMETERS["move_base"], {"controller_frequency": float(rate_hz), "DWAPlannerROS": planner}
            ),
        }
        for name, value in own.items():
            self.node.params.set(f"/{name}", value)
        self.time_s = self.commands = self.goals = 0
        self.node.subscribe("/clock", load_message_class("rosgraph_msgs/Clock"), self._on_clock)
        self.node.subscribe("/cmd_vel", load_message_class("geometry_msgs/Twist"), self._on_command)
        result = load_message_class("move_base_msgs/MoveBaseActionResult")
        self.node.subscribe("/move_base/result", result, lambda _: self.send_goal())
        self._goals = self.node.advertise(
            "/move_base_simple/goal", load_message_class("geometry_msgs/PoseStamped"), queue_size=1
        )
        self.start("rosrun", "map_server", "map_server", APARTMENT, **QUIET)
        for package, program in (("amcl", "amcl"), ("move_base", "move_base"), ("pipros_sim", "sim")):
            self.start("rosrun", package, program, f"__name:={program}", **QUIET)
        wait_until(lambda: self._goals.connection_count and self.time_s > 6, 300, "move_base")
        self.pids = {name: self._pid_of(name) for name in ("move_base", "amcl")}

    def _on_clock(self, message):
        self.time_s = in_ns(message.clock) / 1e9

    def _on_command(self, _):
        self.commands += 1

    def _pid_of(self, name):
        return next(
            each.pid for each in psutil.Process().children(recursive=True)
            if f"__name:={name}" in each.cmdline() and "rosrun" not in each.cmdline()[1]
        )  # fmt: skip

    def send_goal(self):
        """Send the next goal."""
        self._goals.publish(plane.stamped_pose(GOALS[self.goals % 2], "map", Time(0, 0)))
        self.goals += 1

    def costs(self, seconds):
        """Return the processor time of both nodes, and the number of commands, per simulated second."""
        before, begun_s, commands = (
            {each: cpu_s(pid) for each, pid in self.pids.items()},
            self.time_s,
            self.commands,
        )
        wait_until(lambda: self.time_s >= begun_s + seconds, 3600, f"{seconds} s")
        taken_s = self.time_s - begun_s
        used = {each: (cpu_s(pid) - before[each]) / taken_s for each, pid in self.pids.items()}
        return used["move_base"], used["amcl"], (self.commands - commands) / taken_s


def main():
    options = options_of(__doc__, seconds=20.0, only="")
    rows = [tuple(map(int, each.split("x"))) for each in options.only.split(",") if each] or ROWS
    print(
        "| samples | commands per s | move_base | amcl | standing still | one command | half a core | Pi 4? |"
    )
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for samples, rate_hz in rows:
        with Drive(samples, rate_hz) as drive:
            still, _, _ = drive.costs(options.seconds / 2)
            drive.send_goal()
            moving, localizing, commands = drive.costs(options.seconds)
        each_s = max(moving - still, 1e-9) / max(commands, 1e-9)
        half_hz, slow_hz = (max(0.0, share - still - localizing) / each_s for share in (0.5, 1 / SLOWER))
        cells = (samples, f"{commands:.1f}", f"{moving:.2f} s", f"{localizing:.2f} s", f"{still:.2f} s",
                 f"{1000 * each_s:.0f} ms", f"{half_hz:.0f} Hz", f"{slow_hz:.0f} Hz")  # fmt: skip
        print(f"| {' | '.join(map(str, cells))} |", flush=True)


if __name__ == "__main__":
    main()

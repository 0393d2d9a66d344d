"""What LeRobot's own programs do with pipros: train with a data set, and replay a drive of a robot.

`tests.support.lerobot_dataset` calls this, in an environment with LeRobot and the plug-ins.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import Twist
from std_srvs.srv import Empty

from pipros import Core, Environment, Node
from pipros_data import LiveRobot, open_bags
from pipros_data.commands.dataset import main as dataset
from tests.support.waiting import wait_until

BIN = Path(sys.executable).parent
DRIVE = """\
rate: 30
time: receipt
tolerance: 1
watchdog: {watchdog}
gaps: hold
task: drive a curve
observations:
  odom: {{topic: /odom, fields: [pose.pose.position.x, pose.pose.position.y]}}
actions:
  base: {{topic: /cmd_vel, fields: [linear.x, angular.z], min: -1, max: 1}}
"""
SIMULATION = (f"{BIN}/rosrun", "pipros_sim", "sim", "_headless:=true", "_speed:=0.25")
"""Slow, so that a pause of a busy processor is a short distance."""
TRUTH = "/base_pose_ground_truth"


def train(root: Path, folder: Path) -> None:
    """Train a policy for ten steps, without pretrained weights."""
    command = [
        f"{BIN}/lerobot-train",
        "--dataset.repo_id=local/data",
        f"--dataset.root={root}",
        "--dataset.video_backend=pyav",
        f"--output_dir={folder / 'trained'}",
        "--policy.type=act",
        "--policy.device=cpu",
        "--policy.push_to_hub=false",
        "--policy.pretrained_backbone_weights=null",
        "--policy.chunk_size=10",
        "--policy.n_action_steps=10",
        "--policy.dim_model=64",
        "--policy.n_heads=4",
        "--policy.dim_feedforward=128",
        "--steps=10",
        "--batch_size=2",
        "--num_workers=0",
        "--log_freq=1",
        "--save_freq=10",
        "--wandb.enable=false",
    ]
    ended = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    steps = [line[line.index("loss") :].split()[0] for line in ended.stdout.splitlines() if " loss:" in line]
    assert ended.returncode == 0, ended.stdout[-4000:]
    assert len(steps) == 10, ended.stdout[-4000:]
    print(f"ten steps of training: {steps[0]} to {steps[-1]}", flush=True)


@contextmanager
def program(*command: str, **variables: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a program until the block ends."""
    started = subprocess.Popen(command, env={**os.environ, **variables}, stdout=subprocess.DEVNULL)
    try:
        yield started
    finally:
        started.send_signal(signal.SIGINT)
        started.wait(30)


@contextmanager
def recorded(bag: Path, master_uri: str, topics: list[str], node: Node) -> Iterator[None]:
    """Record topics, from when all of them are connected."""
    record = [f"{BIN}/rosbag", "record", "-O", str(bag), *topics]
    with program(*record, ROS_MASTER_URI=master_uri):

        def is_recording() -> bool:
            subscribers = dict(node.master.get_system_state()[1])
            return all(any("record" in name for name in subscribers.get(each, ())) for each in topics)

        wait_until(is_recording)
        yield


def path_of(bag: Path) -> Any:
    """Return the times (s) since the first movement of more than 1 mm, and the positions then."""
    with open_bags(bag) as bags:
        table = bags.table(TRUTH)
    places = np.stack([table["pose.pose.position.x"], table["pose.pose.position.y"]], axis=1)
    first = int(np.argmax(np.linalg.norm(places - places[0], axis=1) > 0.001))
    return (table.times()[first:] - table.times()[first]) / 1e9, places[first:]


def drive_and_replay(folder: Path) -> None:
    """Record a drive in simulated time, make a data set of it, replay it, and compare the two paths."""
    # Off, because the watchdog counts real time: a pause of a busy machine would stop the robot.
    (folder / "robot.yaml").write_text(DRIVE.format(watchdog=0))
    with Core(port=0) as core:
        environment = Environment(master_uri=core.uri)
        with Node("test", environment=environment) as node, ExitStack() as stack:
            node.params.set("/use_sim_time", True)
            stack.enter_context(program(*SIMULATION, ROS_MASTER_URI=core.uri))
            topics = ["/odom", "/cmd_vel", TRUTH]
            with (
                LiveRobot(folder / "robot.yaml", master_uri=core.uri, timeout_s=60) as robot,
                recorded(folder / "drive.bag", core.uri, topics, node),
            ):
                clock = robot.node.clock
                begin_ns = clock.now_ns()
                for n in range(300):
                    robot.act([0.3 * np.sin(np.pi * n / 300), 0.6 * np.cos(n / 40)])
                    clock.sleep(begin_ns / 1e9 + (n + 1) / 30 - clock.now_ns() / 1e9)
                robot.act([0.0, 0.0])
                clock.sleep(1)
            command = [str(folder / "drive.bag"), "--config", str(folder / "robot.yaml"), "-q"]
            assert dataset([*command, "-o", str(folder / "drive"), "--format", "lerobot"]) == 0
            for replay in (replay_on_grid, lerobot_replay):
                node.client("/reset_positions", Empty).call(Empty._request_class(), 60)
                with recorded(folder / f"{replay.__name__}.bag", core.uri, [TRUTH], node):
                    replay(folder, core.uri)
    (times, places), (_, others) = (path_of(folder / f"{name}.bag") for name in ("drive", "replay_on_grid"))
    distances = np.linalg.norm(places[:, None] - others[None], axis=2)
    apart = max(distances.min(axis=0).max(), distances.min(axis=1).max())
    end = distances[-1, -1]
    print(
        f"a drive of {length_of(places):.2f} m in {times[-1]:.1f} s, replayed from the data set through the "
        f"plug-in: paths at most {100 * apart:.1f} cm apart, ends {100 * end:.1f} cm (goal: 5)",
        flush=True,
    )
    # Its loop knows wall time only, in which the simulation is slow.
    driven = length_of(path_of(folder / "lerobot_replay.bag")[1])
    print(f"lerobot-replay found the plug-in, and drove the robot {driven:.2f} m", flush=True)
    assert length_of(places) > 1
    assert max(apart, end) < 0.05
    assert driven > 0.1


def length_of(places: Any) -> float:
    """Return the length (m) of a path."""
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def replay_on_grid(folder: Path, master_uri: str) -> None:
    """Send the actions of a data set through the plug-in, at absolute times."""
    import_module("lerobot.utils.import_utils").register_third_party_plugins()
    plugin = import_module("lerobot_robot_ros1")
    config = plugin.Ros1RobotConfig(description=str(folder / "robot.yaml"), master_uri=master_uri)
    robot = import_module("lerobot.robots").make_robot_from_config(config)
    root = folder / "drive" / "lerobot"
    found: Any = import_module("lerobot.datasets.lerobot_dataset").LeRobotDataset("local/data", root=root)
    names = found.features["action"]["names"]
    assert set(robot.action_features) == set(names)
    assert list(robot.observation_features) == found.features["observation.state"]["names"]
    actions = [each["action"].tolist() for each in found.hf_dataset]
    robot.connect()
    clock = robot._live.node.clock
    begin_ns = clock.now_ns()
    for number, action in enumerate(actions):
        robot.get_observation()
        robot.send_action(dict(zip(names, action, strict=True)))
        clock.sleep(begin_ns / 1e9 + (number + 1) / found.fps - clock.now_ns() / 1e9)
    robot.disconnect()


def lerobot_replay(folder: Path, master_uri: str) -> None:
    """Replay the data set with LeRobot's program, which finds the plug-in by itself."""
    replay = [
        f"{BIN}/lerobot-replay",
        "--robot.type=ros1",
        f"--robot.description={folder / 'robot.yaml'}",
        f"--robot.master_uri={master_uri}",
        "--dataset.repo_id=local/data",
        f"--dataset.root={folder / 'drive' / 'lerobot'}",
        "--dataset.episode=0",
        "--dataset.fps=30",
        "--play_sounds=false",
    ]
    ended = subprocess.run(replay, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert ended.returncode == 0, ended.stdout[-4000:]


POLICY = """
import sys, time
from pipros_data import LiveRobot
with LiveRobot(sys.argv[1], master_uri=sys.argv[2], timeout_s=60) as robot:
    while True:
        robot.act([0.25, 0])
        time.sleep(0.02)
"""


def kill_policies(folder: Path, watchdog: float, trials: int) -> list[float | None]:
    """Kill policies of a robot that holds its last command. Return the times (s) until it stands, or None."""
    path = folder / "killed.yaml"
    path.write_text(
        DRIVE.format(watchdog=watchdog).replace(
            "  odom: {topic: /odom, fields: [pose.pose.position.x, pose.pose.position.y]}\n", "  {}\n"
        )
    )
    found: list[float | None] = []
    with Core(port=0) as core, Node("robot", environment=Environment(master_uri=core.uri)) as node:
        commands: list[tuple[float, float]] = []
        node.subscribe("/cmd_vel", Twist, lambda each: commands.append((time.monotonic(), each.linear.x)))
        for _ in range(trials):
            commands.clear()
            process = subprocess.Popen([sys.executable, "-c", POLICY, str(path), core.uri])
            wait_until(lambda: len([at for at, speed in commands if speed]) > 20)
            process.kill()
            killed_s = time.monotonic()
            process.wait()
            with suppress(AssertionError):
                wait_until(lambda: commands[-1][1] == 0, timeout_s=3)
            stops = [at - killed_s for at, speed in commands if speed == 0 and at > killed_s]
            found.append(stops[0] if stops else None)
    return found


def stop_when_killed(folder: Path, trials: int = 20) -> None:
    """Measure how long a robot drives on after its policy was killed, with and without the watchdog."""
    found = kill_policies(folder, 0.5, trials)
    times = sorted(each for each in found if each is not None)
    print(
        f"a policy is killed: {len(times)} of {trials} robots were stopped, after a median of "
        f"{1000 * times[len(times) // 2]:.0f} ms, at most {1000 * times[-1]:.0f} ms",
        flush=True,
    )
    assert len(times) == trials
    without = kill_policies(folder, 0, 3)
    print(
        f"without the watchdog: {sum(each is not None for each in without)} of 3 robots were stopped",
        flush=True,
    )
    assert without == [None] * 3

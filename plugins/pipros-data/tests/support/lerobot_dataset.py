"""Data sets in LeRobot's format, read again with its library, used for training, and replayed on a robot.

    python -m tests.support.lerobot_dataset

Needs LeRobot with torch, and the plug-ins. Fails if a number, a picture or a task differs from those in the
bags, if training fails, or if a replayed drive leads elsewhere. Also opens the other formats with h5py,
duckdb and pandas.
"""

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

os.environ["HF_HUB_OFFLINE"] = "1"

import av
import duckdb
import h5py
import numpy as np
import pandas
from sensor_msgs.msg import Image, JointState
from std_srvs.srv import Empty

from pipros import Core, Environment, Node
from pipros.msg.time import Time
from pipros_data import LiveRobot, open_bags
from pipros_data.commands.dataset import main as dataset
from tests.support.bags import Row, bag_bytes
from tests.support.waiting import wait_until

CONFIG = """\
rate: 10
task: wave
observations: {arm: {topic: /joints, names: [a, b]}}
actions: {arm: {topic: /joints, names: [b, a]}}
cameras: {front: {topic: /image}}
"""


def write_bag(path: Path, first: int) -> None:
    rows: list[Row] = []
    for n in range(20):
        time = divmod((100 * 10 + n) * 10**8, 10**9)
        state = JointState(name=["a", "b"], position=[first + n, -n])
        pixels = np.full((64, 96, 3), 10 * n, np.uint8)
        image = Image(height=64, width=96, encoding="rgb8", step=288, data=pixels.tobytes())
        state.header.stamp = image.header.stamp = Time(*time)
        rows += [("/joints", state, *time), ("/image", image, *time)]
    path.write_bytes(bag_bytes(rows))


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot.yaml").write_text(CONFIG)
        for number in range(2):
            write_bag(folder / f"run{number}.bag", 1000 * number)
        command = [
            str(folder / "run*.bag"), "--config", str(folder / "robot.yaml"), "-o", str(folder / "out"),
        ]  # fmt: skip
        assert dataset([*command, "--format", "lerobot"]) == 0
        check(folder / "out" / "lerobot")
        assert dataset([*command, "--format", "lerobot"]) == 0, "a finished data set is not an error"
        other_formats(folder, command)
        drive_and_replay(folder)
        train(folder / "out" / "lerobot", folder)


def other_formats(folder: Path, command: list[str]) -> None:
    """Open Parquet and HDF5 with duckdb, pandas and h5py."""
    for kind in ("parquet", "hdf5"):
        assert dataset([*command[:-1], str(folder / kind), "--format", kind, "-q"]) == 0
    file = folder / "parquet" / "data" / "episode_000001.parquet"
    frame = pandas.read_parquet(file)
    assert frame["observations.arm"].map(list).tolist() == [[1000 + n, -n] for n in range(20)]
    opened = duckdb.read_parquet(str(file))
    found = opened.aggregate('count(*), max("observations.arm"[1]), any_value(task)').fetchall()
    assert found == [(20, 1019.0, "wave")]
    with h5py.File(folder / "hdf5" / "data" / "episode_000001.hdf5") as hdf5:
        assert hdf5["observations/arm"][:].tolist() == [[1000 + n, -n] for n in range(20)]
    versions = ", ".join(f"{each.__name__} {each.__version__}" for each in (pandas, duckdb, h5py))
    print(f"Parquet and HDF5 have the same numbers in {versions}")


def check(root: Path) -> None:
    found: Any = import_module("lerobot.datasets.lerobot_dataset").LeRobotDataset(
        "local/data", root=root, video_backend="pyav"
    )
    assert (found.num_episodes, found.num_frames, found.fps) == (2, 40, 10)
    assert found.features["observation.state"]["names"] == ["arm.a", "arm.b"]
    for row in range(40):
        each = found[row]
        episode, n = divmod(row, 20)
        assert each["observation.state"].tolist() == [1000 * episode + n, -n]
        assert each["action"].tolist() == [-n, 1000 * episode + n]
        assert each["task"] == "wave"
        assert tuple(each["observation.images.front"].shape) == (3, 64, 96)
        assert abs(float(each["observation.images.front"].mean()) * 255 - 10 * n) < 4
    batches = list(import_module("torch.utils.data").DataLoader(found, batch_size=8, shuffle=True))
    assert sum(len(batch["action"]) for batch in batches) == 40
    lerobot, torch = (import_module(name).__version__ for name in ("lerobot", "torch"))
    print(f"Python {sys.version.split()[0]}, LeRobot {lerobot}, torch {torch}, numpy {np.__version__}")
    print(f"LeRobot reads {found.num_frames} frames in {found.num_episodes} episodes; av {av.__version__}")


BIN = Path(sys.executable).parent
DRIVE = """\
rate: 30
time: receipt
tolerance: 1
watchdog: 0
gaps: hold
task: drive a curve
observations:
  odom: {topic: /odom, fields: [pose.pose.position.x, pose.pose.position.y]}
actions:
  base: {topic: /cmd_vel, fields: [linear.x, angular.z], min: -1, max: 1}
"""
SIMULATION = (f"{BIN}/rosrun", "pipros_sim", "sim", "_headless:=true", "_speed:=0.25")
"""Slow, so that a pause of a busy processor is a short distance."""
TRUTH = "/base_pose_ground_truth"


def train(root: Path, folder: Path) -> None:
    """Train a policy for ten steps, without pretrained weights."""
    output = lerobot(
        "train", "--dataset.repo_id=local/data", f"--dataset.root={root}", "--dataset.video_backend=pyav",
        f"--output_dir={folder / 'trained'}", "--policy.type=act", "--policy.device=cpu",
        "--policy.push_to_hub=false", "--policy.pretrained_backbone_weights=null", "--policy.chunk_size=10",
        "--policy.n_action_steps=10", "--policy.dim_model=64", "--policy.n_heads=4",
        "--policy.dim_feedforward=128", "--steps=10", "--batch_size=2", "--num_workers=0", "--log_freq=1",
        "--save_freq=10", "--wandb.enable=false",
    )  # fmt: skip
    steps = [line[line.index("loss") :].split()[0] for line in output.splitlines() if " loss:" in line]
    assert len(steps) == 10, output[-4000:]
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
    (folder / "robot.yaml").write_text(DRIVE)
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
    lerobot(
        "replay", "--robot.type=ros1", f"--robot.description={folder / 'robot.yaml'}",
        f"--robot.master_uri={master_uri}", "--dataset.repo_id=local/data",
        f"--dataset.root={folder / 'drive' / 'lerobot'}", "--dataset.episode=0", "--dataset.fps=30",
        "--play_sounds=false",
    )  # fmt: skip


def lerobot(program: str, *arguments: str) -> str:
    """Run a program of LeRobot, and return its output."""
    command = [f"{BIN}/lerobot-{program}", *arguments]
    ended = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert ended.returncode == 0, ended.stdout[-4000:]
    return ended.stdout


if __name__ == "__main__":
    main()

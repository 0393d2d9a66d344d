"""`pipros_sim` in lockstep with a node that drives by what it measures."""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.schedule import Schedule
from pipros_simulation.robots import lockstep, robots_node
from pipros_simulation.robots.settings import RobotSettings
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.world import World
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SIM = ("rosrun", "pipros_sim", "sim", "_headless:=true", "_robot:={odometry_noise: 0.2, wheel_slip: 0.1}")
WALKER = "_obstacles:=[{points: [[2, 1], [2, -1]]}]"


class Driver:
    """A member of the lockstep that turns away from obstacles, and notes where the robot was."""

    def __init__(self, node: Node, until_s: float) -> None:
        self.node, self.until_s = node, until_s
        self.trace: list[tuple[float, float]] = []
        self.changed = threading.Condition()
        self.held = threading.Event()
        """The time stands still, and all messages sent before have been handled."""
        self._nearest = 9.0
        self._twist: Any = load_message_class("geometry_msgs/Twist")
        self._commands = node.advertise("/cmd_vel", self._twist, queue_size=1)
        node.subscribe("/scan", load_message_class("sensor_msgs/LaserScan"), self._see, queue_size=1)
        odometry: Any = load_message_class("nav_msgs/Odometry")
        node.subscribe("/base_pose_ground_truth", odometry, self._note, queue_size=100)
        self.schedule = Schedule(node, self._hold)
        self.schedule.every(0.1, self._drive)
        self.schedule.start()

    @property
    def has_ended(self) -> bool:
        return self.node.clock.now_ns() >= self.until_s * 1e9

    def _hold(self) -> bool:
        with self.changed:
            if self.has_ended:
                self.held.set()
            return self.has_ended and not self.changed.wait(0.05)

    def _see(self, scan: Any) -> None:
        self._nearest = min(*scan.ranges[:30], *scan.ranges[-30:])

    def _note(self, odometry: Any) -> None:
        position = odometry.pose.pose.position
        self.trace.append((position.x, position.y))

    def _drive(self) -> None:
        command = self._twist()
        command.linear.x, command.angular.z = (0.4, 0.1) if self._nearest > 0.8 else (0.0, 1.0)
        self._commands.publish(command)


@contextmanager
def driven(ros: RosSystem, *arguments: str, until_s: float = 24.0) -> Iterator[tuple[Driver, Process]]:
    """Run the simulator with a driver until the time stands still."""
    with Node("driver", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set("/use_sim_time", True)
        node.params.set("/lockstep", ["driver"])
        node.use_simulated_time()
        driver = Driver(node, until_s)
        sim = ros.pipros.start(*SIM, *arguments)
        wait_until(driver.held.is_set, 60, "the end of the drive")
        yield driver, sim


def test_the_same_seed_gives_the_same_trace_twice_and_another_seed_does_not(ros: RosSystem) -> None:
    ros.serve_master()
    traces = []
    for seed in (4, 4, 5):
        with driven(ros, f"_seed:={seed}", WALKER) as (driver, sim):
            traces.append(driver.trace[-1000:])
            sim.press_ctrl_c()
            assert sim.wait() == 0
            sim.wait_for(r"simulated (19|20)\.\d s in \d+\.\d s: \d+\.\d times real time")

    assert len(set(traces[0])) > 300, "the robot drives"
    assert traces[0] == traces[1]
    assert traces[0] != traces[2]


def test_the_lockstep_begins_when_its_topics_are_connected(ros: RosSystem) -> None:
    ros.serve_master()
    with Node("driver", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set("/use_sim_time", True)
        node.params.set("/lockstep", ["driver"])
        node.use_simulated_time()
        driver = Driver(node, until_s=60.0)
        # The master says so, but the node does not connect.
        node.master.register_subscriber("/odom", "nav_msgs/Odometry", node.uri)
        sim = ros.pipros.start(*SIM)
        sim.wait_for(r"the lockstep begins when there is a connection of \[/odom\] from .* to \[/driver\]")
        assert not any(x for x, _ in driver.trace)

        node.master.unregister_subscriber("/odom", node.uri)
        wait_until(lambda: any(x for x, _ in driver.trace), what="a robot that drives")


def test_a_member_works_although_another_one_needs_its_work_to_start(ros: RosSystem, monkeypatch) -> None:
    """move_base waits for the transforms of a filter that is a member, too."""
    monkeypatch.setattr(robots_node, "SLOW_S", 0.0)
    ros.serve_master()
    environment = Environment(master_uri=ros.master_uri)
    with Node("filter", environment=environment) as node, Node("sim", environment=environment) as sim:
        node.params.set("/use_sim_time", True)
        node.params.set("/lockstep", ["filter", "late"])
        has_worked = threading.Event()
        schedule = Schedule(node)
        schedule.every(0.1, has_worked.set)
        schedule.start()
        robots = robots_node.RobotsNode(
            sim, Simulation(World.from_cells(np.zeros((9, 9), bool), 1.0), [RobotSettings()])
        )
        thread = threading.Thread(target=robots.run)
        thread.start()
        assert has_worked.wait(60)
    thread.join(60)
    assert not thread.is_alive()


def test_the_time_stands_still_while_a_member_holds_it_and_goes_on_without_a_dead_one(ros: RosSystem) -> None:
    ros.serve_master()
    clocks: list[int] = []
    with driven(ros, until_s=5.0) as (driver, sim):
        stopped_ns = driver.node.clock.now_ns()
        with driver.changed:
            driver.until_s = 6.0
            driver.held.clear()
            driver.changed.notify_all()
        wait_until(driver.held.is_set, what="the next second")
        assert (stopped_ns, driver.node.clock.now_ns()) == (5_000_000_000, 6_000_000_000)
    with Node("listener", environment=Environment(master_uri=ros.master_uri)) as listener:
        clock: Any = load_message_class("rosgraph_msgs/Clock")
        listener.subscribe("/clock", clock, lambda message: clocks.append(message.clock.to_nsec()))
        sim.wait_for(r"the lockstep continues without \[/driver\]")
        wait_until(lambda: clocks and clocks[-1] > 6_100_000_000, what="time without members")


def test_a_node_that_cannot_be_a_member_is_left_out(ros: RosSystem, monkeypatch, caplog) -> None:
    ros.serve_master()
    monkeypatch.setattr(lockstep, "FOREIGN_S", 0.0)
    environment = Environment(master_uri=ros.master_uri)
    with (
        Node("sim", environment=environment) as sim,
        Node("twist_mux", environment=environment) as mux,
        Node("starting", environment=environment) as starting,
    ):
        sim.params.set("/lockstep", ["twist_mux", "starting", "absent"])
        for node in (mux, starting):
            node.advertise("/cmd_vel", load_message_class("geometry_msgs/Twist"))
        Schedule(starting)
        text = "[/twist_mux] runs, but cannot be in lockstep"
        checked = lockstep.Lockstep(sim, lockstep.members(sim), logging.getLogger("lockstep"))
        wait_until(lambda: text in (checked.missing() and caplog.text))
        assert checked.missing() == ["/starting", "/absent"]
        checked.close()
    assert "/starting" not in caplog.text


def test_a_wrong_list_of_members_ends_the_simulator(ros: RosSystem) -> None:
    ros.serve_master()
    with Node("a_test", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set("/use_sim_time", True)
        node.params.set("/lockstep", "amcl")
    sim = ros.pipros.run(*SIM)
    assert sim.returncode == 1
    sim.wait_for(r"/lockstep must be a list of node names, got 'amcl'")

#!/usr/bin/env python3
"""Costs of simulated robots: the figures in docs/course.md and docs/simulation.md.

    script/bench costs [--only turtlesim,robots]

`turtlesim`: processor time of a node with two moving turtles and a subscriber for each of their topics.
`robots`: processor time of pipros_sim with ten robots and subscribers for their odometry, transforms and
scans (360 rays at 10 Hz). Only pipros is measured, because genuine ROS has no counterpart to pipros_sim.
"""

import time

from programs import QUIET, Programs, cpu_s
from table import options_of

from pipros.msg import load_message_class, load_service_class


def steered(program, last_service, topics, counted, robots, speeds, seconds, prepare=lambda _: None):
    """Run a simulator, subscribe to its topics, and steer its robots five times per second.

    After two seconds, measure for `seconds`. Return the percentage of a processor that the simulator uses,
    and the messages per second and robot on the topics named `counted`.
    """
    twist, got = load_message_class("geometry_msgs/Twist"), []
    command = twist()
    command.linear.x, command.angular.z = speeds
    with Programs() as programs:
        process = programs.start("rosrun", *program, **QUIET)
        node = programs.node()
        while last_service not in dict(node.master.get_system_state()[2]):
            time.sleep(0.05)
        prepare(node)
        for topic, kind in topics.items():
            take = got.append if topic.endswith(counted) else lambda _: None
            node.subscribe(topic, load_message_class(kind), take)
        publishers = [node.advertise(f"/{robot}/cmd_vel", twist) for robot in robots]
        for duration in (2.0, seconds):
            before, count, start = cpu_s(process.pid), len(got), time.monotonic()
            while time.monotonic() - start < duration:
                for publisher in publishers:
                    publisher.publish(command)
                time.sleep(0.2)
            used, passed = cpu_s(process.pid) - before, time.monotonic() - start
        return 100 * used / passed, (len(got) - count) / passed / len(robots)


def turtlesim():
    def prepare(node):
        spawn = load_service_class("turtlesim/Spawn")
        node.client("/spawn", spawn).call(spawn._request_class(x=2.0, y=2.0, name="turtle2"), 10)

    turtles = "turtle1", "turtle2"
    topics = {f"/{each}/pose": "turtlesim/Pose" for each in turtles}
    topics |= {f"/{each}/color_sensor": "turtlesim/Color" for each in turtles}
    program = "turtlesim", "turtlesim_node"
    percent, rate = steered(program, "/kill", topics, "pose", turtles, (1.5, 1.5), 5.0, prepare)
    print(f"turtlesim with two turtles                 {percent:6.1f} % of a processor")
    print(f"poses a turtle sent                        {rate:6.1f} Hz")


def robots():
    names = [f"robot_{index}" for index in range(10)]
    topics = {f"/{each}/scan": "sensor_msgs/LaserScan" for each in names} | {"/tf": "tf2_msgs/TFMessage"}
    topics |= {f"/{each}/odom": "nav_msgs/Odometry" for each in names}
    program = "pipros_sim", "sim", "_robots:=10", "_headless:=true"
    percent, rate = steered(program, "/reset_positions", topics, "scan", names, (0.2, 0.5), 10.0)
    print(f"pipros_sim with ten robots                 {percent:6.1f} % of a processor")
    print(f"scans a robot sent                         {rate:6.1f} Hz")


if __name__ == "__main__":
    for name in options_of(__doc__, only="turtlesim,robots").only.split(","):
        {"turtlesim": turtlesim, "robots": robots}[name]()

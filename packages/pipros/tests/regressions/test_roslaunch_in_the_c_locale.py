"""ROS Answers: with LANG=C, as in cron, roslaunch failed for files with letters other than ASCII."""

from __future__ import annotations

import sys

import pytest

from pipros.basics.env import Environment
from pipros.node import Node
from tests.support.ros import RosSystem

LAUNCH = """<?xml version="1.0" encoding="UTF-8"?>
<launch>
  <!-- Größe in µm -->
  <arg name="name" default="Zoë"/>
  <param name="robot" value="$(arg name) €"/>
  <param name="from_command" command="PYTHON -c 'print(&quot;Straße&quot;)'"/>
  <param name="from_file" textfile="$(dirname)/text.txt"/>
  <rosparam file="$(dirname)/values.yaml"/>
</launch>
"""
VALUES = {"robot": "Zoë €", "from_command": "Straße\n", "from_file": "Übung", "von_yaml": "Señal"}


@pytest.mark.parametrize("locale", ["C", "POSIX"])
def test_files_with_other_letters_are_read_in_the_c_locale(ros: RosSystem, locale: str) -> None:
    (ros.home / "x.launch").write_text(LAUNCH.replace("PYTHON", sys.executable), "utf-8")
    (ros.home / "text.txt").write_text("Übung", "utf-8")
    (ros.home / "values.yaml").write_text("von_yaml: Señal  # größer\n", "utf-8")
    ros.pipros.start_master()
    launch = ros.pipros.run("roslaunch", "x.launch", LC_ALL=locale, LANG=locale)
    assert launch.returncode == 0, launch.output
    with Node("reader", environment=Environment(master_uri=ros.master_uri)) as node:
        assert {name: node.params.get(f"/{name}") for name in VALUES} == VALUES

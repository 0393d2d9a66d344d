#!/usr/bin/env python3
"""Offer the settings of Drive.cfg, if a page of the documents has written it."""

from pathlib import Path

import rospkg

import rospy

rospy.init_node("drive")
if (Path(rospkg.RosPack().get_path("my_robot")) / "cfg" / "Drive.cfg").exists():
    from my_robot.cfg import DriveConfig

    from dynamic_reconfigure.server import Server

    server = Server(DriveConfig, lambda config, level: config)
rospy.spin()

"""Robots under a policy: the topics of `robot.yaml`, live."""

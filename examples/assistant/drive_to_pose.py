#!/usr/bin/env python3
"""Drive a robot to a point, as an assistant does: read the pose, publish commands for a moment, and repeat.

    python3 drive_to_pose.py X Y -- pipros mcp --simulate --policy drive.yaml

Approve the first act for a minute with `pipros mcp approve` in another terminal.
"""

import asyncio
import json
import math
import sys

from mcp import Client, StdioServerParameters

NEAR_M = 0.1
SPEED = 0.25
TURN = 0.8
STEPS = 15


async def call(client, tool, **arguments):
    """Call a tool, and return the rows of its answer."""
    result = await client.call_tool(tool, arguments)
    answer = json.loads(result.content[0].text)
    if result.is_error:
        raise RuntimeError(f"{answer['error']}: {answer.get('data', '')}")
    return answer["data"]


async def pose_of(client):
    """Return x, y and yaw of the robot."""
    rows = await call(client, "read_topic", topic="/odom", part="pose/pose")
    pose = rows[1]["message"]
    yaw = 2 * math.atan2(pose["orientation"]["z"], pose["orientation"]["w"])
    return pose["position"]["x"], pose["position"]["y"], yaw


async def drive(client, linear, angular, seconds):
    twist = {"linear": {"x": linear}, "angular": {"z": angular}}
    await call(client, "publish", topic="/cmd_vel", message=twist, seconds=min(seconds, 5.0))


async def drive_to(client, goal_x, goal_y):
    for _ in range(STEPS):
        x, y, yaw = await pose_of(client)
        distance = math.hypot(goal_x - x, goal_y - y)
        print(f"at ({x:.2f}, {y:.2f}), {distance:.2f} m to go", flush=True)
        if distance < NEAR_M:
            return
        direction = math.atan2(goal_y - y, goal_x - x) - yaw
        turn = math.atan2(math.sin(direction), math.cos(direction))
        if abs(turn) > 0.2:
            await drive(client, 0.0, math.copysign(TURN, turn), abs(turn) / TURN)
        else:
            await drive(client, SPEED, 0.0, distance / SPEED)
    raise RuntimeError("something is in the way")


async def main():
    separator = sys.argv.index("--")
    goal_x, goal_y = map(float, sys.argv[1:separator])
    program, *arguments = sys.argv[separator + 1 :]
    async with Client(StdioServerParameters(command=program, args=arguments)) as client:
        try:
            await drive_to(client, goal_x, goal_y)
        except RuntimeError as error:
            print(error, file=sys.stderr)
            return 1
    return 0


sys.exit(asyncio.run(main()))

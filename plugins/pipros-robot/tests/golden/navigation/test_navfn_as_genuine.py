"""Plans of navfn beside genuine ones: costs, distances from obstacles, and what is published."""

import math
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from pipros.msg import load_message_class
from tests.support.both_costmaps import both_costmaps, grid_message
from tests.support.both_navigation import SIDES, BothNodes
from tests.support.nodes import Inbox
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

RESOLUTION = 0.05
NODE = ("navfn", "navfn_node", "global_planner")


def building() -> Any:
    """Return the cells of a building of 12 by 10 metres, with a closed room and unknown parts."""
    cells = np.zeros((200, 240), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    for x in (60, 120, 180):
        cells[0:90, x] = cells[110:200, x] = 100
        cells[20:32, x] = cells[150:165, x] = 0
    cells[100, 0:70] = cells[100, 90:240] = 100
    cells[60:75, 80:100] = 100
    cells[130:170, 130:150] = -1
    cells[10:40, 200] = cells[10:40, 230] = cells[10, 200:231] = cells[40, 200:231] = 100
    return cells


def pose(x: float, y: float, yaw: float = 0.0, frame: str = "map") -> Any:
    made: Any = load_message_class("geometry_msgs/PoseStamped")()
    made.header.frame_id = frame
    made.pose.position.x, made.pose.position.y = x, y
    made.pose.orientation.z, made.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return made


def positions(poses: Any) -> Any:
    return np.array([(each.pose.position.x, each.pose.position.y) for each in poses])


def price(published: Any, path: Any) -> float:
    """Return the cost along a path, from interpolated published costs."""
    costs = 50 + 0.8 * np.where(published < 0, 253, published * 2.55)
    middles = ((path[1:] + path[:-1]) / 2 / RESOLUTION).T[::-1]
    lengths = np.hypot(*(path[1:] - path[:-1]).T) / RESOLUTION
    return float((map_coordinates(costs, middles, order=1) * lengths).sum())


def wait_for_links(both: BothNodes, *inboxes: dict[str, Inbox]) -> None:
    """Plan until a plan has arrived on the topics of pipros, so that none is lost later."""

    def has_arrived() -> bool:
        both.call("global_planner/make_plan", "navfn/MakeNavPlan", start=pose(1, 1), goal=pose(1.5, 1.5))
        return all(pair["pipros"].messages for pair in inboxes)

    wait_until(has_arrived, 60, "plans on the topics")


def reaches(inbox: Inbox, x: float, y: float) -> bool:
    """Return whether the newest path ends at a position."""
    poses = inbox.messages[-1].poses
    return bool(poses) and math.dist(positions(poses[-1:])[0], (x, y)) < RESOLUTION


def columns(cloud: Any) -> Any:
    """Return x, y, z and the potential of each point, sorted by place."""
    rows = np.frombuffer(cloud.data, np.float32).reshape(-1, cloud.point_step // 4)
    offsets = [field.offset // 4 for field in cloud.fields]
    return rows[:, offsets]


def compare_potentials(ours: Any, theirs: Any) -> None:
    """Check that both waves have reached the same places and, but for their order, the same potentials."""
    assert [(field.name, field.datatype) for field in ours.fields] == [
        (field.name, field.datatype) for field in theirs.fields
    ]
    found = [
        {(round(x / 0.05), round(y / 0.05)): p for x, y, _, p in columns(cloud).tolist()}
        for cloud in (ours, theirs)
    ]
    common = found[0].keys() & found[1].keys()
    assert len(common) >= 0.9 * max(map(len, found))
    # The genuine wave computes most cells once, so that its potentials are a little too high.
    ratios = [found[0][cell] / found[1][cell] for cell in common if found[1][cell] > 500]
    assert 0.98 < np.median(ratios) <= 1.0
    assert np.quantile(ratios, 0.99) < 1.005


def test_plans_cost_the_same_and_keep_the_same_distance(ros: RosSystem, recording: Recording) -> None:
    parameters = {
        "plugins": [
            {"name": "fixed", "type": "costmap_2d::StaticLayer"},
            {"name": "around", "type": "costmap_2d::InflationLayer"},
        ],
        "track_unknown_space": True, "robot_radius": 0.17,
        "around": {"inflation_radius": 0.6, "cost_scaling_factor": 4.0},
    }  # fmt: skip
    numbers = np.random.default_rng(2)
    cells = building()
    planner = {"navfn_planner": {"default_tolerance": 0.12, "visualize_potential": True}}
    with both_costmaps(ros, recording, parameters, (1.0, 1.0, 0.0), program=NODE, others=planner) as costmaps:
        both = costmaps.both
        both.publish("map", grid_message(cells, RESOLUTION, (0.0, 0.0)))
        published = costmaps.wait_until_equal()
        service = "/global_planner/make_plan"
        wait_until(lambda: service in both.interface("pipros")["services"], 60, service)
        distances = distance_transform_edt(cells != 100) * RESOLUTION
        found = 0
        for _ in range(25):
            (a, b), (c, d) = numbers.uniform((0.3, 0.3), (11.7, 9.7), (2, 2))
            request = {"start": pose(a, b), "goal": pose(c, d, 1.2)}
            ours, theirs = both.call("global_planner/make_plan", "navfn/MakeNavPlan", **request)
            assert (ours.plan_found, ours.error_message) == (theirs.plan_found, theirs.error_message), request
            if not theirs.plan_found:
                continue
            found += 1
            last, expected = ours.path[-1].pose, theirs.path[-1].pose
            # Which cells near the goal the wave has reached when it ends depends on its order.
            assert abs(last.position.x - expected.position.x) < 1.01 * RESOLUTION
            assert abs(last.position.y - expected.position.y) < 1.01 * RESOLUTION
            assert last.orientation.z == expected.orientation.z
            assert ours.path[0].pose == theirs.path[0].pose
            paths = [positions(each.path) for each in (ours, theirs)]
            prices = [price(published, path) for path in paths]
            assert prices[0] <= 1.02 * prices[1], (request, prices)
            nearest = [distances[tuple((path / RESOLUTION).astype(int).T[::-1])].min() for path in paths]
            assert nearest[0] >= nearest[1] - 1.5 * RESOLUTION, (request, nearest)
        assert 10 <= found < 25  # some goals are in walls or in the closed room

        plans = both.inboxes("global_planner/navfn_planner/plan", "nav_msgs/Path")
        clouds = both.inboxes("global_planner/navfn_planner/potential", "sensor_msgs/PointCloud2")
        wait_for_links(both, plans, clouds)
        both.publish("global_planner/goal", pose(1.5, 8.0, 0.5), to="/pipros/")
        for inbox in plans.values():
            wait_until(lambda inbox=inbox: reaches(inbox, 1.5, 8.0), 60, "the plan to the goal")  # type: ignore[misc]
            first, second = inbox.messages[-2:]
            assert len(second.poses) == len(first.poses) + 1
            assert second.header.frame_id == "map"
        for inbox in clouds.values():
            wait_until(lambda inbox=inbox: len(columns(inbox.messages[-1])) > 5000, 60, "potentials")  # type: ignore[misc]
        compare_potentials(*(clouds[side].messages[-1] for side in SIDES))
        interfaces = [both.interface(side) for side in SIDES]
        for each in interfaces:
            each["subscriptions"].pop("/global_planner/costmap/footprint", None)
        assert interfaces[0] == interfaces[1]

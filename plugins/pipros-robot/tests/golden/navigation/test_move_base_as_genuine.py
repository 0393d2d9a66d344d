"""move_base beside the genuine one: results, interfaces, and the commands of the local planner."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class, load_service_class
from pipros_libraries.transforms.pose import IDENTITY
from pipros_robot.navigation.costmap.grid import CostGrid
from pipros_robot.navigation.dwa.planner import DwaPlanner
from pipros_robot.navigation.dwa.settings import SETTINGS, DwaSettings
from tests.support.both_bases import PARAMETERS, BothBases, both_bases
from tests.support.recordings import Recording, message_of
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

ANOTHER = "This goal was canceled because another goal was recieved by the simple action server"

FOOTPRINT = [(0.13, 0.11), (0.13, -0.11), (-0.13, -0.11), (-0.13, 0.11)]
"""That of `PARAMETERS`, with the padding."""


@pytest.fixture
def both(ros: RosSystem, recording: Recording) -> Iterator[BothBases]:
    with both_bases(ros, recording) as both:
        yield both


def numbers(**values: float) -> Any:
    """Return the settings of a request to dynamic_reconfigure."""
    config: Any = load_message_class("dynamic_reconfigure/Config")()
    number: Any = load_message_class("dynamic_reconfigure/DoubleParameter")
    config.doubles = [number(key, value) for key, value in values.items()]
    return config


def reconfigure(both: BothBases, name: str, **values: float) -> None:
    """Change numbers, in the namespace `move_base` or one below."""
    both.call(f"{name}set_parameters", "dynamic_reconfigure/Reconfigure", config=numbers(**values))


def raise_maxima(both: BothBases) -> None:
    """Raise the maxima of pipros, which refuses minima above them; the genuine node takes these."""
    service: Any = load_service_class("dynamic_reconfigure/Reconfigure")
    client = both.node.client("/pipros/move_base/DWAPlannerROS/set_parameters", service)
    client.call(service._request_class(config=numbers(max_vel_trans=9.0, max_vel_theta=9.0)), timeout_s=60.0)


def test_goals_end_with_the_same_statuses_and_texts(both: BothBases) -> None:
    def ends(*expected: tuple[int, str]) -> None:
        assert both.next_results(len(expected)) == [list(expected), list(expected)]

    both.velocity = (0.0, 0.0)
    both.send(0.0, 0.0)
    ends((3, "Goal reached."))
    both.send(2.0, 0.0)
    both.wait_until_active()
    both.send(2.0, 0.5)
    ends((2, ANOTHER))
    both.wait_until_active()
    both.cancel()
    ends((2, ""))
    both.send(1.1, 0.55)  # inside the block
    ends((4, "Failed to find a valid plan. Even after executing recovery behaviors."))
    both.send(1.0, 0.0, quaternion_w=0.0)
    ends((4, "Aborting on goal because it was sent with an invalid quaternion"))
    reconfigure(both, "", oscillation_timeout=1.0)
    both.send(2.0, 0.0)
    ends((4, "Robot is oscillating. Even after executing recovery behaviors."))
    reconfigure(both, "", oscillation_timeout=0.0, controller_patience=0.5)
    raise_maxima(both)
    reconfigure(both, "DWAPlannerROS/", min_vel_trans=5.0, min_vel_theta=9.0)
    both.send(2.0, 0.0)
    ends((4, "Failed to find a valid control. Even after executing recovery behaviors."))


def test_services_parameters_topics_and_settings_are_the_same(both: BothBases) -> None:
    _compare_parameters(both)
    _compare_registrations(both)
    _compare_settings(both)
    _compare_plans(both)
    both.call("clear_costmaps", "std_srvs/Empty")
    wait_until(lambda: _has_the_far_wall(both), 30, "the map")


def _has_the_far_wall(both: BothBases) -> bool:
    """Return whether the global costmap has a corner of the map, which no sensor reaches."""
    costs = both.latest("move_base/global_costmap/costmap", "nav_msgs/OccupancyGrid")
    return bool(costs.data[0] == 100)


def _compare_plans(both: BothBases) -> None:
    pose: Any = load_message_class("geometry_msgs/PoseStamped")
    for x, y, tolerance in ((2.0, 0.5, 0.0), (1.1, 0.55, 0.0), (1.1, 0.55, 1.0)):
        goal = pose()
        goal.header.frame_id, goal.pose.orientation.w = "map", IDENTITY[6]
        goal.pose.position.x, goal.pose.position.y = x, y
        request = {"start": pose(), "goal": goal, "tolerance": tolerance}
        # The first plan may be made before the costmap has seen a scan.
        wait_until(partial(_are_plans_equal, both, request), 30, f"equal plans to {x}, {y} ({tolerance})")


def _are_plans_equal(both: BothBases, request: dict[str, Any]) -> bool:
    """Return whether both find no plan, or plans of the same length to the same pose."""
    own, genuine = (
        np.array([(each.pose.position.x, each.pose.position.y) for each in response.plan.poses])
        for response in both.call("make_plan", "nav_msgs/GetPlan", **request)
    )
    if not len(genuine):
        return not len(own)
    lengths = [np.hypot(*np.diff(plan, axis=0).T).sum() if len(plan) else 0 for plan in (own, genuine)]
    return bool(lengths[0] == pytest.approx(lengths[1], rel=0.05) and own[-1] == pytest.approx(genuine[-1]))


def _compare_parameters(both: BothBases) -> None:
    def flat(values: dict[str, Any], prefix: str = "") -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, value in values.items():
            found |= flat(value, f"{prefix}{key}/") if isinstance(value, dict) else {f"{prefix}{key}": value}
        return found

    def differing() -> set[str]:
        own, genuine = flat(both.parameters()[0]), both.parameters()[1]
        return {key for key in own.keys() | genuine.keys() if own.get(key) != genuine.get(key)}

    wait_until(lambda: not differing(), 20, lambda: str(differing()))


def _compare_registrations(both: BothBases) -> None:
    publishers, subscribers, services = both.node.master.get_system_state()
    types = dict(both.node.master.get_topic_types())

    def named(table: list[Any], *, with_type: bool = True) -> set[tuple[str, str]]:
        return {
            (name.removeprefix("/pipros"), types.get(name, "") if with_type else "")
            for name, nodes in table
            if "/pipros/move_base" in nodes and name not in ("/rosout", "/clock")
        }

    def recorded(name: str) -> set[tuple[str, str]]:
        return {(name, kind) for name, kind in both.recording.value(name)}

    assert named(publishers) == recorded("publications")
    assert named(services, with_type=False) == recorded("services")
    # genuine also subscribes to the footprints that it publishes itself, with a type that cannot match
    more = named(subscribers) ^ recorded("subscriptions")
    assert {name.rpartition("/")[2] for name, _ in more} == {"footprint"}


def _compare_settings(both: BothBases) -> None:
    kind = "dynamic_reconfigure/ConfigDescription"
    for name in ("", "DWAPlannerROS/"):
        topic = f"move_base/{name}parameter_descriptions"
        described = [both.latest(topic, kind), _recorded(both.recording, topic, kind)]
        fields = [
            [(each.name, each.type, each.level) for each in found.groups[0].parameters] for found in described
        ]
        assert fields[0] == fields[1]
        for part in ("dflt", "min", "max"):
            own, genuine = (_config(getattr(found, part)) for found in described)
            assert own == genuine


def _recorded(recording: Recording, topic: str, kind: str) -> Any:
    """Return the next message of a topic on which the genuine node repeats its messages."""
    return message_of(load_message_class(kind), recording.step(f"latest {topic}"))


def _config(message: Any) -> dict[str, Any]:
    lists = (message.bools, message.ints, message.strs, message.doubles)
    return {each.name: each.value for values in lists for each in values}


def test_the_local_planner_chooses_the_commands_of_the_genuine_one(recording: Recording) -> None:
    """The planner gets genuine's plan and costs, and must find the same command with the same score."""
    parameters = PARAMETERS["DWAPlannerROS"]
    recording.give("parameters", parameters)
    names = {each.name: each.default for each in SETTINGS}
    given = {name: value for name, value in parameters.items() if name in names}
    for velocity in ((0.2, 0.1), (0.0, 0.0), (0.5, -0.6)):
        recording.give("velocity", velocity)
        planner = DwaPlanner(DwaSettings.of({**names, **given}, sim_period=0.1))
        plan = _recorded(recording, "move_base/DWAPlannerROS/global_plan", "nav_msgs/Path")
        points = [(each.pose.position.x, each.pose.position.y) for each in plan.poses]
        planner.look_at(_costmap_of_genuine(recording), FOOTPRINT, (0.0, 0.0, 0.0), points)
        choice = planner.choose((0.0, 0.0, 0.0), (velocity[0], 0.0, velocity[1]))

        command = message_of(load_message_class("geometry_msgs/Twist"), recording.step("command"))
        expected = (command.linear.x, command.linear.y, command.angular.z)
        assert choice.command == pytest.approx(expected, abs=1e-6)
        tried = _recorded(recording, "move_base/DWAPlannerROS/trajectory_cloud", "sensor_msgs/PointCloud2")
        cloud = np.frombuffer(tried.data, np.float32).reshape(-1, tried.point_step // 4)
        legal = choice.scores[choice.scores >= 0]  # genuine stops adding up a score that exceeds the lowest
        assert legal.min() == pytest.approx(cloud[:, 4].min(), abs=1e-3)


def _costmap_of_genuine(recording: Recording) -> CostGrid:
    """Return the local costmap: exact where the robot may be, from the cloud of costs."""
    shown = _recorded(recording, "move_base/local_costmap/costmap", "nav_msgs/OccupancyGrid")
    cloud = _recorded(recording, "move_base/DWAPlannerROS/cost_cloud", "sensor_msgs/PointCloud2")
    grid = CostGrid()
    origin = shown.info.origin.position
    grid.resize(shown.info.width, shown.info.height, 0.05, origin.x, origin.y)
    values = np.array(shown.data, np.int16).reshape(grid.costs.shape)
    grid.costs[:] = np.select([values < 0, values == 100, values == 99], [255, 254, 253], 250)
    points = np.frombuffer(cloud.data, np.float32).reshape(-1, cloud.point_step // 4)
    columns, rows, inside = grid.world_to_cells(points[:, 0].astype(float), points[:, 1].astype(float))
    assert inside.all()
    grid.costs[rows, columns] = points[:, 5]
    return grid

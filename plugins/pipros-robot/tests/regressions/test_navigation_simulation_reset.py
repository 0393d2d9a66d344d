"""navigation, yujin_ocs: after the simulated time was set back, old commands and obstacles stayed."""

import numpy as np

from pipros_libraries.transforms.pose import IDENTITY
from pipros_robot.navigation.costmap.observations import ObservationSource, SourceSettings
from pipros_robot.navigation.velocities.velocity_smoother import Feedback, VelocityLimits, VelocitySmoother

S = 1_000_000_000


def test_a_smoother_stops_the_robot_whose_commands_ended_with_the_old_time() -> None:
    limits = VelocityLimits(speed=(1.0, 2.0), acceleration=(1.0, 2.0), deceleration=3.0)
    log: list[str] = []
    smoother = VelocitySmoother(limits, 0.1, Feedback.NONE, lambda _, text: log.append(text))
    smoother.command((0.2, 0.0), 100.0)
    assert [smoother.step(100.0) for _ in range(2)] == [(0.1, 0.0), (0.2, 0.0)]
    assert [smoother.step(2.0), smoother.step(2.1)] == [(0.0, 0.0), None]
    assert len(log) == 1
    smoother.command((0.1, 0.0), 2.2)
    assert smoother.step(2.2) == (0.1, 0.0)


def test_a_costmap_forgets_observations_of_the_old_time() -> None:
    source = ObservationSource(SourceSettings("scan", observation_persistence=5.0))
    points = np.zeros((1, 3), np.float32)
    for stamp_s in (98, 99, 100, 2, 3):
        source.add(points, IDENTITY, IDENTITY, stamp_s * S, stamp_s * S, 1000)
    assert [each.stamp_ns // S for each in source.observations()] == [3, 2]

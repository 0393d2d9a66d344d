"""Any ROS 1 robot as a robot of LeRobot: `--robot.type=ros1 --robot.description=robot.yaml`."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from lerobot.robots import Robot, RobotConfig

from pipros_data import LiveRobot


@RobotConfig.register_subclass("ros1")
@dataclass(kw_only=True)
class Ros1RobotConfig(RobotConfig):
    """The robot.yaml of a robot, and its master; by default that of ROS_MASTER_URI."""

    description: str
    master_uri: str | None = None


class Ros1Robot(Robot):
    """The features have the names and the order of the data sets that `pipros dataset` makes."""

    config_class = Ros1RobotConfig
    name = "ros1"
    is_calibrated = True
    observation_features = property(
        lambda self: dict.fromkeys(self._live.state_names, float) | self._live.cameras
    )
    action_features = property(lambda self: dict.fromkeys(self._live.action_names, float))
    is_connected = property(lambda self: "_live" in self.__dict__)

    def __init__(self, config: Ros1RobotConfig) -> None:
        super().__init__(config)
        self.config = config

    @cached_property
    def _live(self) -> LiveRobot:
        return LiveRobot(self.config.description, master_uri=self.config.master_uri)

    def connect(self, calibrate: bool = True) -> None:
        """Connect. The nodes of ROS 1 calibrate their devices themselves."""
        del calibrate
        _ = self._live

    def get_observation(self) -> dict[str, Any]:
        state, pictures = self._live.observe()
        return dict(zip(self._live.state_names, state.tolist(), strict=True)) | pictures

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        values = self._live.act([float(action[name]) for name in self._live.action_names])
        return dict(zip(self._live.action_names, values.tolist(), strict=True))

    def disconnect(self) -> None:
        self.__dict__.pop("_live").close()

    def calibrate(self) -> None:
        """Do nothing."""

    configure = calibrate

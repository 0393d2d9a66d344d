"""Joysticks and leader arms of ROS 1 for LeRobot: `--teleop.type=ros1 --teleop.description=robot.yaml`."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

from lerobot.teleoperators import Teleoperator, TeleoperatorConfig

from pipros_data import LiveTeleoperator


@TeleoperatorConfig.register_subclass("ros1")
@dataclass(kw_only=True)
class Ros1TeleoperatorConfig(TeleoperatorConfig):
    """The robot.yaml of a robot, whose actions name topics under `teleop`, and its master."""

    description: str
    master_uri: str | None = None


class Ros1Teleoperator(Teleoperator):
    """Its actions are those of the robot of the same description."""

    config_class = Ros1TeleoperatorConfig
    name = "ros1"
    is_calibrated = True
    feedback_features: ClassVar[dict[str, Any]] = {}
    action_features = property(lambda self: dict.fromkeys(self._live.action_names, float))
    is_connected = property(lambda self: "_live" in self.__dict__)

    def __init__(self, config: Ros1TeleoperatorConfig) -> None:
        super().__init__(config)
        self.config = config

    @cached_property
    def _live(self) -> LiveTeleoperator:
        return LiveTeleoperator(self.config.description, master_uri=self.config.master_uri)

    def connect(self, calibrate: bool = True) -> None:
        """Connect. The nodes of ROS 1 calibrate their devices themselves."""
        del calibrate
        _ = self._live

    def get_action(self) -> dict[str, Any]:
        return dict(zip(self._live.action_names, self._live.read().tolist(), strict=True))

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        raise NotImplementedError("a teleoperator of ROS 1 has no feedback")

    def disconnect(self) -> None:
        self.__dict__.pop("_live").close()

    def calibrate(self) -> None:
        """Do nothing."""

    configure = calibrate

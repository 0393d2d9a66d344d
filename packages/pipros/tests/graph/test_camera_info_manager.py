"""camera_info_manager in a camera driver: its service sets the calibration."""

from __future__ import annotations

import sys
from pathlib import Path

from pipros.master.master import Master
from tests.support.processes import Processes

PROGRAM = """
import rospy
from camera_info_manager import CameraInfoManager
from sensor_msgs.srv import SetCameraInfo

rospy.init_node("driver")
manager = CameraInfoManager("left", "file://${ROS_HOME}/${NAME}.yaml", "stereo/left")
manager.loadCameraInfo()
print(manager.isCalibrated())
service = rospy.ServiceProxy("/stereo/left/set_camera_info", SetCameraInfo)
service.wait_for_service(30)
request = SetCameraInfo._request_class()
request.camera_info.width = 640
request.camera_info.K = [5.0] * 9
print(service(request))
print(manager.isCalibrated(), manager.getCameraInfo().width)
"""


def test_the_service_sets_and_saves_a_calibration(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    environment = {"ROS_MASTER_URI": master.uri, "ROS_HOME": str(tmp_path)}
    ran = processes.run(sys.executable, "-c", PROGRAM, environment=environment)

    assert ran.returncode == 0, ran.output
    assert [line for line in ran.stdout if "[INFO]" not in line] == [
        *("False", "success: True", "status_message: ''", "True 640")
    ], ran.output
    assert "camera_name: left" in (tmp_path / "left.yaml").read_text()

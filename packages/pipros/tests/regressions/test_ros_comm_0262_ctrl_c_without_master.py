"""ros_comm#262: nodes could only be killed with -9 once the master was down."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

from pipros.master.master import Master
from tests.support.processes import Processes

SCRIPT = """
import rospy
from std_msgs.msg import String
from std_srvs.srv import Empty
rospy.init_node("node")
rospy.Publisher("a", String, queue_size=1)
rospy.Subscriber("b", String, print)
rospy.Service("c", Empty, lambda _: [])
print("ready", flush=True)
rospy.spin()
"""


def test_ctrl_c_ends_a_node_whose_master_has_died(processes: Processes, tmp_path: Path) -> None:
    script = tmp_path / "node.py"
    script.write_text(SCRIPT)
    with Master(port=0) as master:
        node = processes.start(sys.executable, script, environment={"ROS_MASTER_URI": master.uri})
        node.wait_for("ready")
    node.send_signal(signal.SIGINT)
    assert node.wait() == 0
    assert "Traceback" not in node.output

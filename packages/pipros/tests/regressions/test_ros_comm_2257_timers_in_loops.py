"""ros_comm#2257: a `rospy.Timer` ended when `rosbag play --loop` began again."""

from __future__ import annotations

import sys
from pathlib import Path

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from tests.support.processes import Processes

SCRIPT = """
import threading
import rospy
from rosgraph_msgs.msg import Clock

rospy.init_node("node")
clock = rospy.Publisher("/clock", Clock, queue_size=10)
times = []

def play(start, enough):
    for seconds in range(start, start + 1000):
        clock.publish(Clock(rospy.Time(seconds)))
        threading.Event().wait(0.002)
        if enough():
            return
    raise SystemExit("the timer did not run")

while not clock.get_num_connections():
    threading.Event().wait(0.01)
timer = rospy.Timer(rospy.Duration(1), lambda event: times.append(event.current_real.secs))
play(5000, lambda: len(times) > 3)
play(10, lambda: sum(time < 4000 for time in times) > 3)
print(timer.is_alive())
rospy.signal_shutdown("done")
"""


def test_a_timer_goes_on_when_a_bag_begins_again(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    client = MasterClient(master.uri, "/test")
    client.set_param("/use_sim_time", True)
    client.close()
    script = tmp_path / "node.py"
    script.write_text(SCRIPT)
    node = processes.run(sys.executable, str(script), environment={"ROS_MASTER_URI": master.uri})
    assert node.stdout == ["True"], node.output

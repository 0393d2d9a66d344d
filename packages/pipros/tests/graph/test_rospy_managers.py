"""The managers in `rospy.impl.registration`: topics and services of a running node."""

from __future__ import annotations

import json
import sys

from pipros.master.master import Master
from tests.support.processes import Processes

PROGRAM = """
import json, rospy
import rospy.impl.registration as registration
from std_msgs.msg import String
from std_srvs.srv import Empty

heard = []

class Listener(registration.RegistrationListener):
    def reg_added(self, name, kind, reg_type):
        heard.append(["added", name, kind.partition(":")[0], reg_type])

    def reg_removed(self, name, kind, reg_type):
        heard.append(["removed", name, kind.partition(":")[0], reg_type])

registration.get_registration_listeners().add_listener(Listener())
rospy.init_node("managed", disable_rosout=True)
heard.clear()
topics, services = registration.get_topic_manager(), registration.get_service_manager()
publisher = rospy.Publisher("out", String, queue_size=1)
subscriber = rospy.Subscriber("in", String)
service = rospy.Service("serve", Empty, lambda request: [])
found = {
    "publications": topics.get_publications(),
    "subscriptions": topics.get_subscriptions(),
    "topics": sorted(topics.get_topics()),
    "impl is shared": topics.get_publisher_impl("/out") is publisher.impl,
    "subscribed impl is shared": topics.get_impl("sub", "/in") is subscriber.impl,
    "has": [topics.has_publication("/out"), topics.has_subscription("/out")],
    "services": [name for name, _ in services.get_services() if name == "/serve"],
    "service": services.get_service("/serve") is service,
    "init": rospy.client._init_node_args[0],
}
acquired = topics.acquire_impl("pub", "/acquired", String)
found["acquired"] = topics.get_topics() == {"/out", "/in", "/acquired"} and acquired.type
topics.release_impl("pub", "/acquired")
found["released"] = topics.has_publication("/acquired")
publisher.unregister()
service.shutdown()
found["left"] = [topics.get_publications(), services.get_service("/serve")]
found["heard"] = heard
print(json.dumps(found))
"""


def test_the_managers_list_the_topics_and_services_of_the_node(processes: Processes, master: Master) -> None:
    ran = processes.run(sys.executable, "-c", PROGRAM, environment={"ROS_MASTER_URI": master.uri})
    assert ran.returncode == 0, ran.output
    assert json.loads(ran.stdout[-1]) == {
        "publications": [["/out", "std_msgs/String"]],
        "subscriptions": [["/in", "std_msgs/String"]],
        "topics": ["/in", "/out"],
        "impl is shared": True,
        "subscribed impl is shared": True,
        "has": [True, False],
        "services": ["/serve"],
        "service": True,
        "init": "managed",
        "acquired": "std_msgs/String",
        "released": False,
        "left": [[], None],
        "heard": [
            ["added", "/out", "std_msgs/String", "pub"],
            ["added", "/in", "std_msgs/String", "sub"],
            ["added", "/serve", "rosrpc", "srv"],
            ["added", "/acquired", "std_msgs/String", "pub"],
            ["removed", "/acquired", "std_msgs/String", "pub"],
            ["removed", "/out", "std_msgs/String", "pub"],
            ["removed", "/serve", "rosrpc", "srv"],
        ],
    }

"""An operator of two robots, on genuine rospy: prints a line for each thing that works."""

from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage

import actionlib
import rospy
from actionlib.msg import TestAction, TestGoal

rospy.init_node("operator")
for name in ("robot1", "robot2"):
    at = "/" + name
    first = rospy.wait_for_message(at + "/chatter", Int32, 30).data
    while rospy.wait_for_message(at + "/chatter", Int32, 30).data <= first:
        pass
    print(name, "chatter", flush=True)
    print(name, "latched", rospy.wait_for_message(at + "/map", String, 30).data, flush=True)
    print(name, "legal", rospy.wait_for_message(at + "/aZ_09/_x__1/9", String, 30).data, flush=True)
    frames = rospy.wait_for_message(at + "/tf_static", TFMessage, 30).transforms
    print(name, "static", [each.child_frame_id for each in frames], flush=True)
    rospy.wait_for_service(at + "/lamp", 30)
    lamp = rospy.ServiceProxy(at + "/lamp", SetBool)
    print(name, "service", lamp(True).message, flush=True)
    try:
        lamp(False)
    except rospy.ServiceException as error:
        print(name, "error", "is broken" in str(error), flush=True)
    client = actionlib.SimpleActionClient(at + "/do", TestAction)
    if not client.wait_for_server(rospy.Duration(30)):
        raise SystemExit("no server")
    client.send_goal_and_wait(TestGoal(41), rospy.Duration(30))
    print(name, "action", client.get_result().result, flush=True)
    echoes = []
    rospy.Subscriber(at + "/echo", String, echoes.append)
    command = rospy.Publisher(at + "/cmd", String, queue_size=10)
    rate = rospy.Rate(20)
    while not echoes:
        command.publish("go")
        rate.sleep()
    print(name, "command", echoes[0].data, flush=True)
print("done", flush=True)

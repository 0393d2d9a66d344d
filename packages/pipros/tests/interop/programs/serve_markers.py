"""Serve interactive markers, change them randomly, and print the messages on the topics."""

import random

from geometry_msgs.msg import Pose
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
    MenuEntry,
)

import rospy
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from interactive_markers.menu_handler import MenuHandler

Feedback = InteractiveMarkerFeedback
NAMES = ["a", "b", "c", "d"]
rospy.init_node("markers")
updates, inits, called = [], [], []
rospy.Subscriber("things/update", InteractiveMarkerUpdate, updates.append)
rospy.Subscriber("things/update_full", InteractiveMarkerInit, inits.append)
server = InteractiveMarkerServer("things", "_1")
feedback_publisher = rospy.Publisher("things/feedback", Feedback, queue_size=10)
chance = random.Random(5)  # noqa: S311


def marker(name):
    made = InteractiveMarker(name=name, description=str(chance.random()))
    made.header.frame_id = "map"
    if chance.random() < 0.5:
        made.header.stamp = rospy.Time(7)
    return made


def pose():
    made = Pose()
    made.position.x = chance.random()
    return made


def insert(name):
    if chance.random() < 0.5:
        return server.insert(marker(name), noted)
    return server.insert(marker(name), click_noted, Feedback.BUTTON_CLICK)


def set_pose(name):
    # The genuine server raises for a marker that was inserted and erased before it was shown.
    if name in server.pending_updates and name not in server.marker_contexts:
        return None
    return server.setPose(name, pose(), Header(frame_id=chance.choice(["", "odom"])))


def set_callback(name):
    return server.setCallback(name, noted)


def noted(message):
    called.append(("default", message.marker_name, message.event_type))


def click_noted(message):
    called.append(("click", message.marker_name, message.event_type))


def feedback(name):
    kind = chance.choice([Feedback.POSE_UPDATE, Feedback.BUTTON_CLICK, Feedback.MOUSE_UP])
    message = Feedback(marker_name=name, event_type=kind, pose=pose())
    message.header.frame_id = "viewer"
    context = server.marker_contexts.get(name)
    # The genuine one calls a missing callback.
    if context and (context.default_feedback_cb or kind in context.feedback_cbs):
        server.processFeedback(message)


def apply_changes(name):
    server.applyChanges()


def clear(name):
    if chance.random() < 0.2:
        server.clear()


def shown(found):
    return found and (found.name, found.description, found.header.frame_id, found.pose.position.x)


ACTIONS = [insert, insert, set_pose, set_callback, feedback, feedback, apply_changes, clear]
ACTIONS += [lambda name: server.erase(name)]
while not server.update_pub.get_num_connections() or not server.init_pub.get_num_connections():
    rospy.sleep(0.01)
for _ in range(600):
    print(chance.choice(ACTIONS)(chance.choice(NAMES)))
    print([shown(server.get(name)) for name in NAMES], called[-1:])

menu = MenuHandler()
first = menu.insert("First", callback=noted)
second = menu.insert("Second", command_type=MenuEntry.ROSRUN, command="a b")
inner = menu.insert("Inner", parent=second, callback=noted)
print(first, second, inner, menu.insert("Lost", parent=99))
print(menu.setCheckState(first, MenuHandler.CHECKED), menu.setCheckState(99, 1), menu.getCheckState(first))
print(menu.setCheckState(inner, MenuHandler.UNCHECKED), menu.setVisible(99, True), menu.getCheckState(99))
print(menu.getTitle(inner), menu.getTitle(99))
server.insert(marker("menu"))
print(menu.apply(server, "menu"), menu.reApply(server))
server.applyChanges()
menu.setVisible(second, False)
print(menu.reApply(server))
server.applyChanges()
while not feedback_publisher.get_num_connections():
    rospy.sleep(0.01)
before = len(called)
# From one viewer without a name, since the genuine server ignores others for a second.
feedback_publisher.publish(Feedback(marker_name="menu", event_type=Feedback.MENU_SELECT, menu_entry_id=first))
while len(called) == before:
    rospy.sleep(0.01)
print(called[-1])
server.erase("menu")
server.applyChanges()
print(menu.reApply(server))


def number():
    return max([message.seq_num for message in updates if message.type], default=0)


while not (number() == server.seq_num and inits and inits[-1].seq_num == server.seq_num):
    rospy.sleep(0.01)
while not any(message.type == InteractiveMarkerUpdate.KEEP_ALIVE for message in updates):
    rospy.sleep(0.01)
for message in [*(message for message in updates if message.type == InteractiveMarkerUpdate.UPDATE), *inits]:
    print(type(message).__name__, message)

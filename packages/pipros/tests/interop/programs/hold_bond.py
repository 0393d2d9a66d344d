"""Hold one side of a bond, and print its events: hold_bond.py ID ACTION [HEARTBEAT_TIMEOUT_S].

ACTION: `break` or `shutdown` ends it when it is formed and a line is read, because the other side may not
have heard this one yet; `wait` waits until it is broken; `alone` waits some seconds for another side.
"""

import sys
import threading
from typing import Any

from bond.msg import Status

import rospy
from bondpy import bondpy


def say(*words: Any) -> None:
    sys.stdout.write(" ".join(map(str, words)) + "\n")  # in one write, because callbacks run in other threads
    sys.stdout.flush()


name, action, *timeout = sys.argv[1:]
rospy.init_node("bond", anonymous=True, disable_signals=True)
told = threading.Event()


def on_broken() -> None:
    say("callback: broken")
    told.set()


bond = bondpy.Bond("/bonds", name, on_broken=on_broken)
bond.set_formed_callback(lambda: say("callback: formed"))
bond.heartbeat_period = 0.2
if timeout:
    bond.heartbeat_timeout = float(timeout[0])
if action == "alone":
    bond.set_connect_timeout(rospy.Duration(5))
else:
    bond.set_connect_timeout(60)
say(bond.get_heartbeat_period(), bond.get_disconnect_timeout(), bond.topic, bond.id, len(bond.instance_id))
bond.start()
for act in (lambda: bond.set_heartbeat_period(2), lambda: setattr(bond, "heartbeat_timeout", 2)):
    try:
        act()
        say("accepted")
    except AssertionError:
        say("AssertionError")
if action == "alone":
    say("formed in no time:", bond.wait_until_formed(rospy.Duration.from_sec(0.01)))
say("formed:", bond.wait_until_formed(rospy.Duration(60)), bool(bond.sister_instance_id))
if action == "wait" and timeout:
    for _ in range(4):  # the genuine one checks the time from the second heartbeat on
        while rospy.wait_for_message("/bonds", Status).instance_id == bond.instance_id:
            pass
    say("broken soon:", bond.wait_until_broken(rospy.Duration.from_sec(0.01)), bond.is_broken())
if action in ("break", "shutdown"):
    sys.stdin.readline()
if action == "break":
    bond.break_bond()
elif action == "shutdown":
    bond.shutdown()
    bond.shutdown()
if action != "shutdown":
    broken = bond.wait_until_broken(rospy.Duration(60))
    say("broken:", broken, bond.is_broken(), bond.sm.getState().getName())
    bond.break_bond()
    say("stays broken:", bond.is_broken())
else:
    say("after shutdown:", bond.wait_until_broken(rospy.Duration(60)))
if action in ("wait", "alone"):
    told.wait(60)
rospy.signal_shutdown("the end")

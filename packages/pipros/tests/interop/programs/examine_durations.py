"""Durations as time limits, time without a node, and timers as threads."""

import threading

from examination import begin, examine, wait_for
from std_msgs.msg import String
from std_srvs.srv import Empty

import rospy

clock = rospy.rostime


def without_a_node():
    examine("now", rospy.Time.now)
    for limit in (0.1, rospy.Duration(0.1), 0, rospy.Duration(0)):
        examine(f"wait_for_service {limit}", lambda: rospy.wait_for_service("/nobody", limit))
    examine("before", lambda: (clock.is_rostime_initialized(), clock.is_wallclock()))
    clock._rostime_initialized = True
    examine("initialized by its private name", clock.is_rostime_initialized)
    clock._rostime_initialized = False
    examine("initialized", lambda: clock.set_rostime_initialized(True))
    examine("after", lambda: (clock.is_rostime_initialized(), clock.is_wallclock()))
    examine("wall", lambda: (rospy.get_time() > 1e9, rospy.Time.now().to_sec() > 1e9))
    examine("rate", lambda: rospy.Rate(100).sleep())
    examine("set", lambda: clock._set_rostime(rospy.Time(5, 7)))
    examine("simulated", lambda: (clock.is_wallclock(), rospy.Time.now(), rospy.get_time()))
    examine("sleep", sleep_while_time_goes_on)
    examine("back", lambda: clock._set_rostime(rospy.Time(1)))
    examine("rate", lambda: type(rospy.Rate(1).remaining()).__name__)
    examine("now", rospy.get_rostime)
    examine("wall clock", lambda: clock.switch_to_wallclock())
    examine("wall again", lambda: (clock.is_wallclock(), rospy.get_time() > 1e9))
    examine("no longer", lambda: clock.set_rostime_initialized(False))
    examine("now", rospy.Time.now)


def sleep_while_time_goes_on():
    slept = threading.Event()

    def go_on():
        seconds = 5
        while not slept.wait(0.02):
            seconds += 1
            clock._set_rostime(rospy.Time(seconds))

    thread = threading.Thread(target=go_on)
    thread.start()
    rospy.sleep(3)
    slept.set()
    thread.join()
    return rospy.get_time() >= 8


def limits():
    proxy = rospy.ServiceProxy("/nobody", Empty)
    for limit in (0, -1, 0.1, rospy.Duration(0.1), rospy.Duration(0)):
        examine(f"wait_for_service {limit}", lambda: rospy.wait_for_service("/nobody", limit))
        examine(f"wait_for_service timeout={limit}", lambda: rospy.wait_for_service("/nobody", timeout=limit))
        examine(f"proxy {limit}", lambda: proxy.wait_for_service(limit))
        examine(f"wait_for_message {limit}", lambda: rospy.wait_for_message("/silent", String, limit))


def timers():
    events = []
    timer = rospy.Timer(rospy.Duration(0.01), events.append)
    examine("thread", lambda: (isinstance(timer, threading.Thread), timer.is_alive(), timer.daemon))
    examine("names", lambda: (type(timer.name).__name__, timer.ident is not None))
    wait_for(lambda: len(events) > 2)
    timer.shutdown()
    timer.join(60)
    examine("ended", timer.is_alive)
    examine("start", timer.start)
    once = rospy.Timer(rospy.Duration(0.01), events.append, oneshot=True)
    once.join(60)
    examine("oneshot", once.is_alive)


def main():
    begin("without_a_node")
    without_a_node()
    rospy.init_node("probe", disable_signals=True)
    for part in (limits, timers):
        begin(part.__name__)
        part()


main()

"""Private names that published packages use, called and set as in those packages."""

import os
import tempfile

import rospkg
from examination import begin, examine, wait_for
from std_msgs.msg import String

import roslaunch.pmon
import roslaunch.substitution_args
import roslib.packages
import rosmsg
import rosnode
import rospy
import rospy.client
import rospy.core
import rostopic
from topic_tools import LazyTransport


class Answers:
    """A master with three nodes on two hosts."""

    def __init__(self):
        self.asked = []

    def lookupNode(self, node):  # noqa: N802
        self.asked.append(node)
        return {"/a": "http://one:1/", "/b": "http://TWO:2/", "/c": "http://one:3/", "/d": "nonsense"}[node]


def tools():
    master = Answers()
    publishers = [["/x", "t/X", ["/a", "/b", "/c"]], ["/y", "t/Y", ["/b"]], ["/z", "t/Z", ["/d"]]]
    examine(
        "hosts", lambda: rostopic._rostopic_list_group_by_host(master, publishers, [["/x", "t/X", ["/a"]]])
    )
    examine("asked", lambda: master.asked)
    examine("unknown", lambda: rostopic._rostopic_list_group_by_host(master, [["/x", "t", ["/e"]]], []))
    examine("succeed", lambda: rosnode._succeed((1, "fine", 5)))
    for code in (0, -1):
        examine("failed", lambda: rosnode._succeed([code, "why", 5]))
    for reply in ((1, 2), None):
        examine("no reply", lambda: isinstance(rosnode._succeed(reply), str))
    examine("same", lambda: type(rospy.client._unspecified) is rospy.client._Unspecified)
    examine("name", lambda: (rospy.client._Unspecified.__name__, rospy.client._Unspecified.__module__))
    examine("paths", lambda: [len(rosmsg._get_package_paths("std_msgs", rospkg.RosPack()))])
    rospy.names._set_caller_id("/robot/probe")
    modules = [lambda: roslib.message, lambda: roslaunch.depends, lambda: roslaunch.param_dump]
    examine("modules", lambda: [module().__name__ for module in modules])
    examine("set", lambda: (rospy.get_name(), rospy.get_namespace(), rospy.resolve_name("~x")))
    rospy.names._set_caller_id("/unnamed")
    examine("rosgraph", lambda: rospy.core.rosgraph.names.ns_join("/a", "b"))


def resources():
    folder = tempfile.mkdtemp()
    for path in ("x", "a/x", "a/b/x", "a/y", ".hidden/x"):
        os.makedirs(os.path.dirname(os.path.join(folder, path)), exist_ok=True)
        open(os.path.join(folder, path), "w").close()
    os.symlink(os.path.join(folder, "a"), os.path.join(folder, "link"))

    def found(*arguments):
        return sorted(path[len(folder) :] for path in roslib.packages._find_resource(folder, *arguments))

    for name in ("x", "y", "z"):
        examine(name, lambda: found(name))
    examine("filter", lambda: found("x", lambda path: "/b/" in path))
    os.makedirs(os.path.join(folder, "some_package"))
    with open(os.path.join(folder, "some_package", "package.xml"), "w") as file:
        file.write("<package><name>some_package</name></package>")
    resolve = roslaunch.substitution_args.resolve_args
    examine("not found", lambda: type(roslaunch.substitution_args._rospack).__name__)
    roslaunch.substitution_args._rospack = rospkg.RosPack([folder])
    examine("found", lambda: resolve("$(find some_package)/x")[len(folder) :])
    roslaunch.substitution_args._rospack = None
    examine("found again", lambda: bool(resolve("$(find std_msgs)")))


def monitors():
    examine("ends", lambda: roslaunch.pmon._shutting_down)
    monitor = roslaunch.pmon.start_process_monitor()
    examine("alive", monitor.is_alive)
    roslaunch.pmon._shutting_down = True
    roslaunch.pmon.rl_signal(2, None)
    examine("second signal", monitor.is_alive)
    examine("none any more", roslaunch.pmon.start_process_monitor)
    roslaunch.pmon._shutting_down = False
    roslaunch.pmon.rl_signal(2, None)
    monitor.join(60)
    examine("first signal", lambda: (monitor.is_alive(), roslaunch.pmon._shutting_down))


class Lazy(LazyTransport):
    def __init__(self, calls):
        super().__init__()
        self.calls = calls
        self.publisher = self.advertise("~output", String, queue_size=1)

    def subscribe(self):
        self.calls.append("subscribe")

    def unsubscribe(self):
        self.calls.append("unsubscribe")


def lazy():
    calls = []
    node = Lazy(calls)
    examine("status", lambda: (node._connection_status, len(node._publishers), calls))
    for _ in range(2):
        subscriber = rospy.Subscriber("~output", String)
        wait_for(lambda: node._connection_status)
        examine("subscribed", lambda: calls)
        subscriber.unregister()
        wait_for(lambda: node._connection_status is False)
        examine("unsubscribed", lambda: calls)
    node.peer_unsubscribe("/x")
    examine("twice", lambda: calls)
    rate = rospy.Rate(10, reset=True)
    rate.last_time = rospy.Time(100)
    for now in (100.5, 99):
        examine("left", lambda: (rate._remaining(rospy.Time(now)), rate.last_time, rate._reset))
    rospy.set_param("~lazy", False)
    node._post_init()
    examine("not lazy", lambda: (calls, node._connection_status))
    node.peer_unsubscribe("/x")
    examine("stays", lambda: calls)
    other = LazyTransport()
    for method in (other.subscribe, other.unsubscribe):
        examine("not defined", lambda: isinstance(raised(method), NotImplementedError))
    examine("listener", lambda: other.advertise("/x", String, None, queue_size=1).name)
    examine("two listeners", lambda: other.advertise("/y", String, node, queue_size=1))
    examine("two listeners", lambda: other.advertise("/y", String, subscriber_listener=node, queue_size=1))


def raised(function):
    try:
        function()
    except Exception as error:
        return error


def main():
    for part in (tools, resources, monitors):
        begin(part.__name__)
        part()
    rospy.init_node("probe", disable_signals=True)
    begin("lazy")
    lazy()


main()

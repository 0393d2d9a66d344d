"""Names, topics and services of rospy before and after init_node, under remappings and a namespace."""

from examination import begin, examine
from std_msgs.msg import String
from std_srvs.srv import Empty

import rospy

NAMES = ("x", "~x", "~/x", "~", "~//x", "~a/b/", "~p", "/", "//", "x/", "/a//b/")
REMAPPED = ("from", "from/", "/cmd/from", "/abs", "abs", "deep/x")
TOPICS = ("x", "~x", "from", "/abs", "abs", "a//b", "x/", "/q/", "~", "/cmd/from")


def names():
    examine("name", rospy.get_name)
    examine("namespace", rospy.get_namespace)
    examine("mappings", lambda: sorted(rospy.names.get_mappings().items()))
    examine("resolved mappings", lambda: sorted(rospy.names.get_resolved_mappings().items()))
    for name in [*NAMES, *REMAPPED, "", None]:
        examine(f"resolve {name}", lambda: rospy.resolve_name(name))
        examine(f"resolve {name} of another", lambda: rospy.resolve_name(name, "/other/node"))
        examine(f"resolve {name} early", lambda: rospy.names.resolve_name_without_node_name(name))
        examine(f"remap {name}", lambda: rospy.remap_name(name))
        examine(f"remap {name} of another", lambda: rospy.remap_name(name, "/other/node"))
        examine(f"remap {name} unresolved", lambda: rospy.remap_name(name, resolved=False))


def handles():
    for name in TOPICS:
        examine(f"Publisher {name}", lambda: rospy.Publisher(name, String, queue_size=1).resolved_name)
        examine(f"Subscriber {name}", lambda: rospy.Subscriber(name, String).resolved_name)
        examine(f"Service {name}", lambda: rospy.Service(name, Empty, lambda _: []).resolved_name)
        examine(f"ServiceProxy {name}", lambda: rospy.ServiceProxy(name, Empty).resolved_name)


def functions():
    check = rospy.names.global_name("topic")
    for value in ("/a", "/a b", "a", "~a", "", None, 3):
        examine(f"global_name {value}", lambda: check(value, "/me"))
    examine("scoped_name", lambda: rospy.names.scoped_name("/ns/node", "/ns/x/y"))
    examine("scoped_name relative", lambda: rospy.names.scoped_name("node", "/x"))
    for name in ("/a/b", "a/b", "a", None, 3):
        examine(f"namespace {name}", lambda: rospy.names.namespace(name))
    examine("ns_join", lambda: [rospy.names.ns_join("/a", name) for name in ("b", "/b", "~b")])


def registered():
    state = rospy.get_master().getSystemState()[2]
    for part in state:
        examine("registered", lambda: sorted(name for name, _ in part if "logger" not in name))


def main():
    begin("before init_node")
    names()
    taken_back = rospy.Service("taken_back", Empty, lambda _: [])
    taken_back.shutdown()
    rospy.Service("taken_back", Empty, lambda _: [])
    handles()
    rospy.init_node("probe", disable_signals=True)
    begin("after init_node")
    names()
    handles()
    functions()
    registered()


main()

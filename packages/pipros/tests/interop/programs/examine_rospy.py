"""Call rospy's public functions with valid and invalid arguments, and print the outcomes.

Run by test_rosconsole_as_genuine.py under genuine rospy and under pipros; knows of neither.
"""

import sys
from types import SimpleNamespace

from examination import begin, examine, wait_for
from geometry_msgs.msg import Point, PointStamped, Twist, Vector3
from roscpp.srv import GetLoggers, SetLoggerLevel
from std_msgs.msg import Header, Int32, String
from std_srvs.srv import Empty, SetBool, Trigger

import actionlib
import rospy
import tf2_ros
from actionlib.msg import TestAction


def before_init():
    examine("name", rospy.get_name)
    examine("caller id", rospy.get_caller_id)
    examine("namespace", rospy.get_namespace)
    examine("node uri", rospy.get_node_uri)
    examine("is_shutdown", rospy.is_shutdown)
    for name in ("x", "~x", "/a//b/", "a/", ""):
        examine(f"resolve {name!r}", lambda name=name: rospy.resolve_name(name))
    examine("now", rospy.Time.now)
    examine("get_time", rospy.get_time)
    examine("rate", lambda: rospy.Rate(1))
    examine("spin", rospy.spin)
    examine("sleep", lambda: rospy.sleep(0))
    examine("get_param", lambda: rospy.get_param("/nope"))
    examine("get_param default", lambda: rospy.get_param("/nope", 5))
    early = rospy.Publisher("early", String, queue_size=1)
    examine("publish", lambda: early.publish("x"))
    examine("proxy", lambda: rospy.ServiceProxy("/nope", Empty)())
    for name in ("", None, "a/b", "/a"):
        examine(f"init {name!r}", lambda name=name: rospy.init_node(name))
    examine("timer", lambda: rospy.Timer(rospy.Duration(0.001), print).join())


def raises(kind, function, *arguments):
    """Return whether the call raises such an exception. Its text is not compared."""
    try:
        function(*arguments)
    except kind:
        return True
    return False


def refusals():
    buffer = tf2_ros.Buffer(debug=False)
    for kind, function, *arguments in (
        (KeyError, rospy.get_param, 5), (KeyError, rospy.delete_param, 5), (TypeError, rospy.set_param, 5, 1),
        (TypeError, rospy.search_param, None), (rospy.ROSException, rospy.search_param, "~x"),
        (ValueError, rospy.Publisher, 5, String), (ValueError, rospy.Subscriber, b"x", String),
        (ValueError, rospy.Service, 5, Empty, print), (TypeError, actionlib.ActionClient, None, TestAction),
        (TypeError, actionlib.ActionServer, None, TestAction, print),
        (TypeError, buffer.can_transform, "a", "b", 1),
        (TypeError, buffer.lookup_transform, "a", "b", rospy.Time(), 1.0),
    ):  # fmt: skip
        name = function.__name__
        examine(f"{name} {arguments[0]!r}", lambda got=(kind, function, *arguments): raises(*got))


def names():
    examine("name", rospy.get_name)
    examine("namespace", rospy.get_namespace)
    for name in ("x", "~x", "/x", "a/", "remapped", "/ns/remapped", "~private", ""):
        examine(f"resolve {name!r}", lambda name=name: rospy.resolve_name(name))
    examine("resolve for other", lambda: rospy.resolve_name("x", "/other/node"))
    examine("remap", lambda: rospy.remap_name("remapped"))
    examine("mappings", lambda: sorted(rospy.names.get_mappings().items()))
    examine("resolved mappings", lambda: sorted(rospy.names.get_resolved_mappings().items()))
    examine("myargv", rospy.myargv)
    examine("myargv given", lambda: rospy.myargv(["a", "b:=c", ":=", "_x:=1", ":=b", "x:=", "q:=r:=s"]))
    for name in ("integer", "text", "list", "dict", "yes", "float", "quoted"):
        examine(f"private {name}", lambda name=name: rospy.get_param("~" + name, "unset"))
    examine("init again", lambda: rospy.init_node("probe", disable_signals=True))
    examine("init other", lambda: rospy.init_node("other"))


def topics():
    for name, data_class in (("t", int), ("t", 3), ("t", "std_msgs/String"), ("", String), (None, String)):
        examine(f"Publisher {name!r}", lambda n=name, d=data_class: rospy.Publisher(n, d, queue_size=1))
        examine(f"Subscriber {name!r}", lambda n=name, d=data_class: rospy.Subscriber(n, d))
    for sizes in ({"queue_size": 0}, {"queue_size": 1.5}, {"buff_size": 0}, {"buff_size": None}):
        examine(f"Subscriber {sizes}", lambda sizes=sizes: rospy.Subscriber("t", String, **sizes))
    examine("Publisher None", lambda: rospy.Publisher("t", None, queue_size=1))
    got = []
    points = rospy.Publisher("points", Point, queue_size=10)
    twists = rospy.Publisher("twists", Twist, queue_size=10)
    rospy.Subscriber("points", Point, got.append)
    words = rospy.Publisher("words", String, queue_size=10)
    examine("publish both", lambda: words.publish(String("x"), data="y"))
    word_subscriber = rospy.Subscriber("words", String, got.append)
    examine("names", lambda: (words.name, words.resolved_name, words.type, words.md5sum, words.data_class))
    wait_for(lambda: points.get_num_connections() and words.get_num_connections())
    wait_for(word_subscriber.get_num_connections)  # the publisher has the link first
    examine("subscriber's connections", word_subscriber.get_num_connections)
    for label, publish in (
        ("one of three", lambda: points.publish(1)), ("all three", lambda: points.publish(1, 2, 3)),
        ("by name", lambda: points.publish(x=4)), ("bad name", lambda: points.publish(q=1)),
        ("both kinds", lambda: points.publish(1, x=1)), ("nothing", lambda: points.publish()),
        ("None of three", lambda: points.publish(None)),
        ("wrong type", lambda: points.publish("a", "b", "c")),
        ("other message", lambda: points.publish(String("x"))),
        ("message for text", lambda: words.publish(Point())), ("bare value", lambda: words.publish("q")),
        ("message", lambda: words.publish(String("m"))), ("None of one", lambda: words.publish(None)),
        ("number for text", lambda: words.publish(3)), ("two of one", lambda: words.publish("a", "b")),
        ("first of two", lambda: twists.publish(Vector3())),
    ):  # fmt: skip
        examine(f"publish {label}", publish)
    wait_for(lambda: len(got) == 6)
    examine("received", lambda: sorted(map(str, got)))
    examine("connection header", lambda: sorted(got[-1]._connection_header))
    words.unregister()
    words.unregister()
    examine("publish unregistered", lambda: words.publish("x"))
    stamped = []
    publisher = rospy.Publisher("stamped", PointStamped, queue_size=5)
    message = PointStamped(header=Header(seq=77))
    publisher.publish(message)
    examine("seq unconnected", lambda: message.header.seq)
    rospy.Subscriber("stamped", PointStamped, lambda m, extra: stamped.append((m.header.seq, extra)), 7)
    wait_for(publisher.get_num_connections)
    publisher.publish(message)
    publisher.publish(message)
    wait_for(lambda: len(stamped) == 2)
    examine("seq", lambda: (stamped, message.header.seq))
    latched = rospy.Publisher("latched", Int32, queue_size=1, latch=True)
    latched.publish(5)
    examine("latched", lambda: rospy.wait_for_message("latched", Int32, 60).data)
    examine("wait_for_message", lambda: rospy.wait_for_message("/silent", String, 0.1))
    raw = []
    rospy.Subscriber("latched", rospy.AnyMsg, raw.append)
    wait_for(lambda: raw)
    examine("AnyMsg", lambda: (type(raw[0]).__name__, raw[0]._type, raw[0]._md5sum))
    examine("published", lambda: sorted(map(tuple, rospy.get_published_topics())))
    examine("published below", lambda: rospy.get_published_topics("/nope"))


def services():
    seen = []

    def keep(request):
        seen.append((request.logger, request.level))
        return {}

    rospy.Service("keep", SetLoggerLevel, keep)
    rospy.Service("none", Trigger, lambda _: None)
    rospy.Service("tuple", Trigger, lambda _: (True, "ok"))
    rospy.Service("list", Trigger, lambda _: [True, "ok"])
    rospy.Service("dict", Trigger, lambda _: {"success": True})
    rospy.Service("empty", Empty, lambda _: [])
    rospy.Service("short", Trigger, lambda _: [True])
    rospy.Service("wrong", Trigger, lambda _: "text")
    rospy.Service("raises", Trigger, lambda _: 1 / 0)

    def refuse(_):
        raise rospy.ServiceException("not today")

    rospy.Service("refuses", Trigger, refuse)
    rospy.Service("header", Trigger, lambda r: (True, str(sorted(r._connection_header))))
    proxy = rospy.ServiceProxy("keep", SetLoggerLevel)
    examine("wait", lambda: proxy.wait_for_service(60))
    for label, call in (
        ("positional", lambda: proxy("a", "b")), ("by name", lambda: proxy(logger="c", level="d")),
        ("request", lambda: proxy(proxy.request_class("e", "f"))), ("call", lambda: proxy.call("g", "h")),
        ("nothing", lambda: proxy()), ("too many", lambda: proxy("a", "b", "c")),
        ("too few", lambda: proxy("a")), ("bad name", lambda: proxy(nope=1)),
        ("wrong type", lambda: proxy(1, 2)), ("None", lambda: rospy.ServiceProxy("none", Trigger)()),
        ("tuple", lambda: rospy.ServiceProxy("tuple", Trigger)()),
        ("list", lambda: rospy.ServiceProxy("list", Trigger)()),
        ("dict", lambda: rospy.ServiceProxy("dict", Trigger)()),
        ("empty", lambda: rospy.ServiceProxy("empty", Empty)()),
        ("raises", lambda: rospy.ServiceProxy("raises", Trigger)()),
        ("refuses", lambda: rospy.ServiceProxy("refuses", Trigger)()),
        ("other type", lambda: rospy.ServiceProxy("keep", SetBool)(True)),
        ("unknown", lambda: rospy.ServiceProxy("nobody", Empty)()), ("resolved", lambda: proxy.resolved_name),
    ):  # fmt: skip
        examine(f"call {label}", call)
    headers = rospy.ServiceProxy("header", Trigger, headers={"token": "x"})
    examine("call headers", lambda: headers().message)
    persistent = rospy.ServiceProxy("keep", SetLoggerLevel, persistent=True)
    examine("persistent", lambda: [persistent(str(number), "x") for number in range(3)])
    persistent.close()
    examine("seen", lambda: seen)
    examine("twice", lambda: rospy.Service("keep", SetLoggerLevel, keep))
    examine("wait_for_service", lambda: rospy.wait_for_service("/nobody", 0.1))
    loggers = rospy.ServiceProxy("~get_loggers", GetLoggers)().loggers
    examine("loggers", lambda: [(logger.name, logger.level) for logger in loggers if logger.name == "rosout"])


def parameters():
    for label, value in (
        ("int", 5), ("float", 0.5), ("bool", True), ("text", "ü <&>"), ("tuple", (1, 2)),
        ("dict", {"a": {"b": [1, "x"]}}), ("object", [SimpleNamespace(a=SimpleNamespace(b=1))]),
    ):  # fmt: skip
        rospy.set_param("/p/" + label, value)
        examine(f"param {label}", lambda label=label: rospy.get_param("/p/" + label))
    for label, value in (("None", None), ("set", {1}), ("key", {1: 2}), ("large", 1 << 40)):
        examine(f"set {label}", lambda value=value: rospy.set_param("/p/x", value))
    examine("get unset", lambda: rospy.get_param("/nope"))
    examine("get relative unset", lambda: rospy.get_param("nope"))
    examine("delete unset", lambda: rospy.delete_param("/nope"))
    examine("has", lambda: (rospy.has_param("/p"), rospy.has_param("/p/int"), rospy.has_param("/nope")))
    examine("cached", lambda: (rospy.get_param_cached("/p/int"), rospy.get_param_cached("/nope", 1)))
    rospy.set_param("~mine", 1)
    examine("search", lambda: (rospy.search_param("mine"), rospy.search_param("p"), rospy.search_param("no")))
    rospy.delete_param("/p/dict")
    examine("namespace", lambda: sorted(rospy.get_param("/p")))
    examine("names", lambda: sorted(name for name in rospy.get_param_names() if name.startswith("/p/")))
    master = rospy.get_master()
    examine("master", lambda: master.getParam("/p/int"))
    examine("master entry", lambda: (master["/p/int"], "/p/int" in master, "/nope" in master))


def times():
    examine("repr", lambda: (rospy.Time(1, 2), rospy.Duration(3, 4), str(rospy.Time(1, 2))))
    examine("arithmetic", lambda: (rospy.Time(5) - rospy.Time(3), rospy.Time(5) + rospy.Duration(1)))
    examine("from_sec", lambda: (rospy.Time.from_sec(1.5), rospy.Duration.from_sec(-0.5)))
    examine("from_seconds", lambda: rospy.Time.from_seconds(2.25))
    examine("mixed", lambda: rospy.Time(1.5, 5))
    examine("negative", lambda: rospy.Time(-1))
    examine("equal", lambda: (rospy.Time(1) == rospy.Time(1), rospy.Time(1) == 1))
    examine("order", lambda: rospy.Time(1) < rospy.Duration(2))
    examine("rate", lambda: (rospy.Rate(4).sleep_dur, type(rospy.Rate(4).remaining()).__name__))
    examine("rate 0", lambda: rospy.Rate(0))
    examine("sleep", lambda: (rospy.sleep(-1), rospy.sleep(0.001), rospy.sleep(rospy.Duration(0, 1000))))
    for bad in ("x", float("nan")):
        examine(f"sleep {bad}", lambda bad=bad: rospy.sleep(bad))
    examine("now", lambda: (type(rospy.Time.now()).__name__, rospy.get_time() > 1e9))
    events = []
    timer = rospy.Timer(rospy.Duration(0.01), events.append)
    wait_for(lambda: len(events) >= 3)
    timer.shutdown()
    first = vars(events[0])
    examine("timer first", lambda: [first[f"last_{end}"] for end in ("expected", "real", "duration")])
    step = events[2].current_expected - events[1].current_expected
    examine("timer step", lambda: (step, type(events[1].last_duration).__name__))
    once = []
    rospy.Timer(rospy.Duration(0.01), once.append, oneshot=True)
    wait_for(lambda: once)
    examine("oneshot", lambda: len(once))


def logs():
    examine("%d of text", lambda: rospy.loginfo("%d", "x"))
    examine("percent", lambda: (rospy.loginfo("100%"), None)[1])  # since 1.17, it returns a bool
    examine("percent with args", lambda: rospy.loginfo("100%", 3))
    for name in ("loginfo_once", "logwarn_once"):
        examine(name, lambda name=name: [(getattr(rospy, name)("once"), None)[1] for _ in range(2)])
    examine("throttle", lambda: [(rospy.loginfo_throttle(60, "throttled %d", n), None)[1] for n in range(2)])
    examine(
        "identical", lambda: [(rospy.loginfo_throttle_identical(60, t), None)[1] for t in ("a", "a", "b")]
    )
    examine("logger_name", lambda: (rospy.loginfo("named", logger_name="sub", stacklevel=2), None)[1])
    examine("not text", lambda: (rospy.loginfo(Point()), None)[1])


def the_end():
    publisher = rospy.Publisher("last", String, queue_size=1)
    order = []

    def hook():
        order.append(("hook", rospy.is_shutdown(), publisher.publish("bye")))

    rospy.on_shutdown(hook)
    rospy.core.add_preshutdown_hook(lambda reason: order.append(("pre", reason, rospy.is_shutdown())))
    rospy.core.add_shutdown_hook(lambda reason: order.append(("post", reason, rospy.is_shutdown())))
    examine("on_shutdown", lambda: rospy.on_shutdown(3))
    rospy.signal_shutdown("done")
    rospy.signal_shutdown("again")
    examine("order", lambda: order)
    late = []
    rospy.on_shutdown(lambda: late.append("hook"))
    rospy.core.add_preshutdown_hook(late.append)
    rospy.core.add_shutdown_hook(late.append)
    examine("late hooks", lambda: late)
    examine("is_shutdown", rospy.is_shutdown)
    examine("publish", lambda: publisher.publish("x"))
    examine("sleep", lambda: rospy.sleep(0.001))
    examine("spin", rospy.spin)
    examine("wait_for_message", lambda: rospy.wait_for_message("/silent", String))
    examine("wait_for_service", lambda: rospy.wait_for_service("/nobody"))


def main():
    before_init()
    rospy.init_node("probe", disable_signals=True)
    for part in (names, refusals, topics, services, parameters, times, logs, the_end):
        begin(part.__name__)
        part()
    sys.stdout.flush()


main()

"""Call functions of ROS's Python packages with valid and invalid plain arguments.

Runs under genuine ROS and under pipros. Each line is one call.
"""

import threading
import warnings

from examination import begin, examine

warnings.simplefilter("ignore")

TEXTS = ["a", "/a", "", "/me/a", None, "~x", "a//b/", "a b", "x:y", "std_msgs/String", "http://h:1", "-"]
PLAIN = (str, int, float, bytes, list, dict, tuple, type(None))


def call(label, function, *args, **kwds):
    shown = [arg for arg in args if isinstance(arg, PLAIN)]
    examine(f"{label}{shown}{kwds or ''}", lambda: function(*args, **kwds))


def call_each(prefix, module, names, arguments):
    for name in names.split():
        for argument in arguments:
            call(f"{prefix}.{name}", getattr(module, name), argument)


def examine_checks():
    import rospy.core
    import rospy.impl.validators
    import rospy.names

    values = [*TEXTS, 0, 5, b"a", ["a"], "/", "*", "rosrpc://x:1"]
    checks = [(rospy.core, "is_topic"), (rospy.names, "global_name"), (rospy.names, "valid_name")]
    checks += [(rospy.impl.validators, "non_empty")]
    for module, name in checks:
        check = getattr(module, name)("p")
        for value in values:
            examine(f"{module.__name__}.{name}({value!r})", lambda: check(value, "/ns/me"))
    for value in values:
        unresolved = rospy.names.valid_name_validator_unresolved
        examine(f"unresolved({value!r})", lambda: unresolved("p", value, "/ns/me"))


def examine_rospy():
    import rospy
    import rospy.impl.masterslave
    import rospy.impl.paramserver
    import rospy.impl.registration
    import rospy.impl.transport

    begin("rospy names")
    rospy.names.reload_mappings(["a:=b", "__ns:=/q", "c:=/d", "~e:=f", "_p:=3"])
    examine("get_mappings", lambda: sorted(rospy.names.get_mappings().items()))
    call("get_resolved_mappings", rospy.names.get_resolved_mappings)
    call("initialize_mappings", rospy.names.initialize_mappings, "/ns/me")
    examine("get_resolved_mappings", lambda: sorted(rospy.names.get_resolved_mappings().items()))
    for name in TEXTS:
        call("resolve_name", rospy.names.resolve_name, name)
        call("remap_name", rospy.names.remap_name, name)
        call("isstring", rospy.names.isstring, name)
    begin("rospy core")
    call("get_node_uri", rospy.core.get_node_uri)
    call("set_node_uri", rospy.core.set_node_uri, "http://x:1")
    call("get_node_uri", rospy.core.get_node_uri)
    for answer in (True, False):
        call("set_initialized", rospy.core.set_initialized, answer)
        call("is_initialized", rospy.core.is_initialized)
    for uri in ("rosrpc://a:1", "rosrpc://a", "http://a:1", "rosrpc://a:1/x", "", "rosrpc://a:b"):
        call("parse_rosrpc_uri", rospy.core.parse_rosrpc_uri, uri)
    throttle, identical, once = (
        rospy.core.LoggingThrottle(), rospy.core.LoggingIdentical(), rospy.core.LoggingOnce(),
    )  # fmt: skip
    rospy.rostime.set_rostime_initialized(True)
    for _ in range(2):
        call("throttle", throttle, "a", 1000)
        call("identical", identical, "a", "text")
        call("identical", identical, "a", "other")
        call("once", once, "z")
    raised = []
    threading.excepthook = lambda what: raised.append((what.exc_type.__name__, str(what.exc_value)))
    rospy.Timer(0.05, lambda event: None).join()  # the period must be a Duration
    examine("timer", lambda: raised)
    call("deprecated", rospy.core.deprecated(lambda number: number + 1), 3)
    examine_registration(rospy)
    examine_cache(rospy)
    examine_slave_checks(rospy.impl.masterslave)


def examine_registration(rospy):
    begin("rospy registration")
    registration = rospy.impl.registration
    topics = registration.get_topic_manager()
    for name in [
        "get_pub_sub_info", "get_pub_sub_stats", "get_topics", "get_publications", "get_subscriptions",
    ]:  # fmt: skip
        call(name, getattr(topics, name))
    for name in ["has_publication", "has_subscription", "get_publisher_impl", "get_subscriber_impl"]:
        call(name, getattr(topics, name), "/none")
    call("get_impl", topics.get_impl, "pub", "/none")
    call("get_services", registration.get_service_manager().get_services)
    call("get_service", registration.get_service_manager().get_service, "/none")
    heard = []

    class Listener(registration.RegistrationListener):
        def reg_added(self, *what):
            heard.append(what)

    listeners = registration.RegistrationListeners()
    listeners.add_listener(Listener())
    listeners.notify_added("/a", "std_msgs/String", registration.Registration.PUB)
    listeners.notify_removed("/a", "std_msgs/String", registration.Registration.PUB)
    examine("heard", lambda: heard)
    listeners.clear()
    examine("listeners", lambda: listeners.listeners)
    transport = rospy.impl.transport.Transport("i", "name")
    examine("transport", lambda: sorted(vars(transport).items()))
    transport.close()
    dead = rospy.impl.transport.DeadTransport(transport)
    examine("dead", lambda: (dead.done, dead.transport_type, dead.name, dead.direction))
    for name in ("fileno", "get_transport_info"):
        call(name, getattr(transport, name))
    call("write_data", transport.write_data, b"")
    handler = rospy.impl.transport.ProtocolHandler()
    for name, *args in (("supports", "x"), ("get_supported",), ("init_publisher", "/a", []), ("shutdown",)):
        call(name, getattr(handler, name), *args)


def examine_cache(rospy):
    begin("rospy parameter cache")
    cache = rospy.impl.paramserver.ParamServerCache()
    told = []
    cache.set_notifier(lambda *what: told.append(what))
    for method, *args in (
        ("get", "/a"), ("set", "/a", 1), ("get", "/a"), ("set", "/b", {"c": {"d": 1}}), ("get", "/b/c/d"),
        ("update", "/b/c", {"d": 3}), ("update", "/zz", 1), ("update", "/b/c/d/", 9), ("get", "/b"),
        ("delete", "/b/c"), ("get", "/b"), ("delete", "/none"), ("delete", "/"), ("set", "/m/n", {"a": 1}),
        ("update", "/m/n/b/c", 5), ("get", "/m"), ("set", "/", 1), ("set", "/", {"q": 1}), ("get", "/"),
    ):  # fmt: skip
        call(method, getattr(cache, method), *args)
    examine("told", lambda: told)


def examine_slave_checks(masterslave):
    begin("rospy slave checks")

    class Api:
        @masterslave.apivalidate(-1, (masterslave.non_empty("topic"), None))
        def method(self, caller_id, topic, anything):
            return 1, "", (topic, anything)

    api = Api()
    for args in ((), ("/me",), ("/me", "a", 1), ("/me", "", 1), (5, "a", 1), ("/me", "a", 1, 2)):
        call("method", api.method, *args)


class Answering:
    """Replaces a proxy of the master."""

    def __init__(self, code):
        self.code = code

    def __getattr__(self, name):
        return lambda *args: (self.code, "text", [name, *args])


def examine_rosgraph():
    import rosgraph
    from rosgraph import names, network

    begin("rosgraph names")
    texts = [text for text in TEXTS if text]  # genuine returns the argument itself if it is empty
    call_each("names", names, "is_global is_private is_legal_name is_legal_base_name isstring", texts)
    call_each(
        "names", names, "canonicalize_name namespace make_global_ns make_caller_id is_legal_remap", texts
    )
    for text in TEXTS:
        if text is not None:
            call("ns_join", names.ns_join, "/ns", text)
        call("resolve_name", names.resolve_name, text, "/ns/me")
        call("script_resolve_name", names.script_resolve_name, "/me", text)
        call("script_resolve_name", names.script_resolve_name, "me", text)
    for argv in (["a:=b"], ["a:=b:=c"], ["_p:=1", "__name:=x", "a b:=c", ":=", "x:="], []):
        call("load_mappings", names.load_mappings, argv)
        call("get_ros_namespace", names.get_ros_namespace, {"ROS_NAMESPACE": "n"}, argv)
    for pattern in ("NAME_LEGAL_CHARS_P", "BASE_NAME_LEGAL_CHARS_P", "REMAP_PATTERN"):
        for text in (*texts, "a:=b", "_a:=b", "__x:=y", ":=z"):
            examine(f"{pattern} {text!r}", lambda: bool(getattr(names, pattern).match(text)))

    begin("rosgraph network")
    uris = [
        "http://a:1", "http://a", "a:1", "", "http://a:b", "http://:5", "http://[::1]:5", "rosrpc://x:5",
        None,
    ]  # fmt: skip
    call_each("network", network, "parse_http_host_and_port", uris)
    for fields in ({"a": "b", b"c": b"d"}, {}, {"a": "x=y"}, {"a": ""}):
        call("encode", network.encode_ros_handshake_header, fields)
    for data in (b"\x09\0\0\0a", b"\x07\0\0\0\x03\0\0\0a=b", b"\x08\0\0\0\x04\0\0\0 a=b", b"\0\0\0\0"):
        call("decode", network.decode_ros_handshake_header, data)
    for argv in (["__master:=http://x"], ["__master:="], ["__master:=a:=b"], []):
        call("get_master_uri", rosgraph.get_master_uri, {}, argv)

    begin("rosgraph master")
    master = rosgraph.Master("/me", "http://127.0.0.1:1")
    for code in (1, 0, -1):
        master.handle = Answering(code)
        for method, *args in (
            ("getPid",), ("lookupNode", "/a"), ("setParam", "/p", {"a": 1}), ("is_online",),
        ):  # fmt: skip
            call(method, getattr(master, method), *args)
    for uri in ("nonsense", "", "http://"):
        call("Master", lambda uri: rosgraph.Master("/me", uri).master_uri, uri)


examine_checks()
examine_rospy()
examine_rosgraph()

"""Attributes of services, rarely used functions of rospy, and log entries with their places."""

import io
import logging
import os
from itertools import product

from examination import begin, examine, wait_for
from geometry_msgs.msg import PointStamped
from roscpp.srv import GetLoggers
from rosgraph_msgs.msg import Log
from std_msgs.msg import String
from std_srvs.srv import Trigger

import genpy
import rosgraph
import rosgraph.roslogging
import rospy
import rospy.client
import rospy.msg

ARGUMENTS = (
    *("p", "a:=b", "-a:=b", ":=", "x:=", "q:=r:=s", "_p:=1", "__name:=n", "~x:=y", "/a/b:=c", "3:=4"),
    *("--x:=1", "_:=1", ":=b", "a-b:=c", "/:=x", "_-a:=2", "b :=c", "a b:=c"),
)


def arguments():
    for argument in ARGUMENTS:
        examine(f"rospy.myargv {argument}", lambda: rospy.myargv([argument]))
        examine(f"rosgraph.myargv {argument}", lambda: rosgraph.myargv([argument]))
        examine(f"is_legal_remap {argument}", lambda: rosgraph.names.is_legal_remap(argument))
    given = ["p", "_a:=5", "_b:=[1, x]", "c:=d", "__name:=n"]
    examine("load_command_line_node_params", lambda: rospy.client.load_command_line_node_params(given))


def hooks():
    for hook in (3, None, "x"):
        for add in ("add_shutdown_hook", "add_preshutdown_hook", "add_client_shutdown_hook"):
            examine(f"{add} {hook}", lambda: getattr(rospy.core, add)(hook))
    examine("_in_shutdown", lambda: rospy.core._in_shutdown)


def services():
    service = rospy.Service("s", Trigger, lambda _: (True, "ok"))
    examine(
        "Service", lambda: (service.uri.split(":")[0], service.buff_size, callable(service.error_handler))
    )
    for answer in ([], [True], [True, "a", "b"], (True,), "x", {"no": 1}, None):
        wrong = rospy.Service("wrong", Trigger, lambda _, answer=answer: answer)
        examine(f"a handler returns {answer}", rospy.ServiceProxy("wrong", Trigger))
        wrong.shutdown()
    examine("protocol", lambda: service.protocol is not None)
    proxy = rospy.ServiceProxy("s", Trigger)
    examine("ServiceProxy", lambda: (proxy.uri, proxy.transport, proxy.buff_size, proxy.protocol is not None))
    needed = ("callerid", "md5sum", "service", "type")
    response = proxy()
    examine("response header", lambda: [response._connection_header[key] for key in needed])
    examine("after a call", lambda: (proxy.uri == service.uri, proxy.transport))
    persistent = rospy.ServiceProxy("s", Trigger, persistent=True)
    responses = persistent(), persistent()
    examine("persistent", lambda: [item._connection_header["callerid"] for item in responses])
    examine("kept", lambda: (persistent.uri == service.uri, persistent.transport is not None))
    persistent.close()


def parameters():
    rospy.set_param("/a/b/k", 3)
    master = rospy.get_master()
    examine("search_param", lambda: (master.search_param("a"), master.search_param("nothing")))
    examine("get_param_cached", lambda: master.get_param_cached("/a/b/k"))
    examine("get_param_cached unset", lambda: master.get_param_cached("/nothing"))


def log_all_on_one_line():
    for n in (1, 2):
        rospy.loginfo_once(f"a{n}"), rospy.loginfo_once(f"b{n}"), rospy.logwarn_once(f"c{n}")
        rospy.loginfo_throttle(60, f"d{n}"), rospy.loginfo_throttle(60, f"e{n}"), rospy.loginfo_once(f"f{n}")
        rospy.loginfo_throttle_identical(60, "g"), rospy.loginfo_throttle(60, f"h{n}")


def logs():
    said = []

    class Ear(logging.Handler):
        def emit(self, record):
            said.append(record.getMessage())

    ear = Ear()
    logging.getLogger("rosout").addHandler(ear)
    log_all_on_one_line()
    logging.getLogger("rosout").removeHandler(ear)
    examine("said", lambda: said)
    got = []
    rospy.Subscriber("/rosout", Log, got.append)

    def arrived():
        rospy.loginfo("where")
        return [message for message in got if message.msg == "where"]

    wait_for(arrived)
    examine("file", lambda: arrived()[0].file)
    loggers = [logger.name for logger in rospy.ServiceProxy("~get_loggers", GetLoggers)().loggers]
    names = ("rospy", "rospy.client", "rospy.core", "rospy.internal", "rospy.topics", "rosgraph", "xmlrpc")
    examine("loggers", lambda: [name in loggers for name in (*names, "rosout")])


def log_files():
    path = rosgraph.roslogging.configure_logging("product")
    logging.getLogger("product").info("a word")
    with open(path) as file:
        examine("is written", lambda: "a word" in file.read())
    examine("path", lambda: os.path.basename(path).replace(str(os.getpid()), "PID"))
    examine("variable", lambda: os.environ["ROS_LOG_FILENAME"] == path)


def buffers():
    buffer = io.BytesIO()
    stamped = PointStamped()
    rospy.msg.serialize_message(buffer, 7, stamped)
    examine("serialized", lambda: (buffer.getvalue(), stamped.header.seq, stamped.header.frame_id))
    for tail in (b"\5\0\0\0ab", b"\5\0", b"", b"\1\0\0\0x"):
        for queue in ([], ["old", "older", "oldest", None]):
            for sizes in product((None, 0, 1, 2, 4, 9, -1, -2), (None, 0, 1, 2, -1)):
                options = dict(zip(("queue_size", "max_msgs"), sizes, strict=True))
                examine(f"{tail} {queue} {options}", lambda: deserialized(tail, list(queue), options))
    for tail in (b"", b"\5\0\0\0ab", b"\1\0\0\0x"):
        for start in (0, 4, 8, 13, 17, 30):
            for options in ({}, {"queue_size": 1}):
                more = {**options, "start": start}
                examine(f"{tail} {more}", lambda: deserialized(tail, ["old", "older"], more))
    for content in (b"", b"\0\0", b"\5\0\0\0abc"):
        examine(f"incomplete {content}", lambda: deserialized(content, [1, 2], {"queue_size": 1}, ()))


def deserialized(tail, queue, options, texts=("", "b", "c")):
    """Return the list, the bytes of the buffer, and its position or the type of an error."""
    buffer = io.BytesIO()
    for text in texts:
        rospy.msg.serialize_message(buffer, 1, String(text))
    buffer.write(tail)
    try:
        rospy.msg.deserialize_messages(buffer, queue, String, **options)
        end = buffer.tell()
    except genpy.DeserializationError as error:
        end = type(error).__name__
    return [getattr(each, "data", each) for each in queue], buffer.getvalue(), end


def main():
    for part in (arguments, hooks):
        begin(part.__name__)
        part()
    rospy.init_node("probe", disable_signals=True)
    for part in (services, parameters, logs, buffers, log_files):
        begin(part.__name__)
        part()


main()

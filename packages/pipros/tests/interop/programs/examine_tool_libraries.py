"""Call functions of rostopic, rosservice, rosparam and rosmsg that scripts use, on a running graph."""

import contextlib
import io
import sys
import threading

from examination import begin, examine, wait_for
from std_msgs.msg import String
from std_srvs.srv import SetBool

import rosgraph
import rosmsg
import rosparam
import rospy
import rosservice
import rostopic

ARGUMENTS = (
    (rostopic.rostopicmain, "rostopic", ("list", "type /ns/z", "type /none", "nonsense", "find", "")),
    (rosservice.rosservicemain, "rosservice", ("list", "type /none", "nonsense", "call", "")),
    (rosparam.yamlmain, "rosparam", ("list", "get /none", "set /a/x 5", "get /a", "nonsense", "")),
    (rosmsg.rosmsgmain, "rosmsg", ("show std_msgs/String", "md5 std_msgs/None", "nonsense", "package none")),
)


def printed(function):
    """Return the result or exception of a function, and its output."""
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()):
        try:
            result = function()
        except SystemExit as end:
            result = f"exit {end.code}" if end.code else None  # genuine tools also exit after a success
    lines = [line for line in out.getvalue().splitlines() if "rosout" not in line and "logger" not in line]
    return result, lines


def lists():
    for name in ("z", "a"):
        rospy.Service(name, SetBool, lambda request: (request.data, ""))
        rospy.Publisher(name, String, queue_size=1)
    examine("services", lambda: own(rosservice.get_service_list()))
    examine("of a node", lambda: own(rosservice.get_service_list(node=rospy.get_name())))
    examine("below", lambda: rosservice.get_service_list(namespace="/nowhere"))
    with_nodes = rosservice.get_service_list(include_nodes=True)
    examine("with nodes", lambda: [one for one in with_nodes if "logger" not in one[0]])
    examine("kinds", lambda: {type(one).__name__ for one in with_nodes})
    examine("find", lambda: rosservice.rosservice_find("std_srvs/SetBool"))
    examine("topics", lambda: rostopic.find_by_type("std_msgs/String"))
    examine("headers", lambda: header_of("/ns/z"))
    for uri in ("http://127.0.0.1:1", "rosrpc://127.0.0.1:1", "nonsense", None):
        examine(f"headers at {uri}", lambda: kind_of_error(rosservice.get_service_headers, "/ns/z", uri))


def own(names):
    return [name for name in names if "logger" not in name]


def header_of(name):
    uri = rosservice.get_service_uri(name)
    header = rosservice.get_service_headers(name, uri)
    return sorted((key, header[key]) for key in ("callerid", "md5sum", "type"))


def kind_of_error(function, *arguments):
    try:
        return function(*arguments)
    except Exception as error:
        kinds = rosgraph.MasterError, rosservice.ROSServiceIOException, rosservice.ROSServiceException
        return next((kind.__name__ for kind in kinds if isinstance(error, kind)), type(error).__name__)


def parameters():
    examine("unset", lambda: kind_of_error(rosparam.get_param, "/none"))
    examine("delete unset", lambda: kind_of_error(rosparam.delete_param, "/none"))
    rosparam.set_param("/q/text", "[1, two]")
    rosparam.set_param_raw("/q/raw", "[1, two]")
    examine("set", lambda: sorted(rosparam.get_param("/q").items()))
    rospy.set_param("/", 5)
    examine("the root is no plain value", lambda: rosparam.get_param("/q/raw"))
    examine("list", lambda: list(rosparam.list_params("/q")))
    rosparam.delete_param("/q")
    examine("deleted", lambda: rosparam.list_params("/q"))


def publishing():
    got = []
    rospy.Subscriber("/said", String, lambda message: got.append(message.data))
    publisher = rospy.Publisher("/said", String, queue_size=50, latch=True)
    examine("wait", lambda: rostopic.wait_for_subscriber(publisher, 60))
    lonely = rospy.Publisher("/lonely", String, queue_size=5)
    examine("wait for nobody", lambda: rostopic.wait_for_subscriber(lonely, 0.1))
    for number, text in enumerate(("data: one", "data: two\n---\ndata: three")):
        with open(str(number), "w") as file:
            file.write(text)
    publish, publish_documents = rostopic.publish_message, rostopic.stdin_publish
    for label, call in (
        ("one message", lambda: publish(publisher, String, ["a"], once=True)),
        ("verbosely", lambda: publish(publisher, String, [{"data": "b"}], once=True, verbose=True)),
        ("two documents", lambda: publish_documents(publisher, String, 50.0, False, "1", True)),
        ("the first", lambda: publish_documents(publisher, String, None, True, "1", False)),
        ("the only one", lambda: publish_documents(publisher, String, None, True, "0", False)),
        ("none", lambda: kind_of_error(publish_documents, publisher, String, None, True, "none", False)),
        ("wrong", lambda: kind_of_error(publish, publisher, String, [{"none": 1}])),
        ("for a while", lambda: rostopic.argv_publish(publisher, String, ["c"], None, True, False)),
    ):
        examine(label, lambda: printed(call))
    wait_for(lambda: len(got) == 7)
    examine("got", lambda: got)


def commands():
    for main, tool, lines in ARGUMENTS:
        for line in lines:
            arguments = [tool, *line.split()]
            if main is rosmsg.rosmsgmain:
                sys.argv = arguments
                examine(" ".join(arguments), lambda: printed(main))
            else:
                examine(" ".join(arguments), lambda: printed(lambda: main(arguments)))


def ends():
    found = []

    def wait():
        found.append(rostopic.get_topic_class("/nobody", blocking=True))
        found.append(rostopic.get_topic_type("/nobody", blocking=True))

    threads = [threading.Thread(target=wait) for _ in range(2)]
    for thread in threads:
        thread.start()
    rospy.signal_shutdown("the end")
    wait_for(lambda: not any(thread.is_alive() for thread in threads))
    examine("classes and types", lambda: found)


def main():
    rospy.init_node("probe", disable_signals=True)
    for part in (lists, parameters, publishing, commands, ends):
        begin(part.__name__)
        part()


main()

"""One of three peers that use every feature with each other. Runs with pipros and with genuine rospy.

Usage: peer.py NAME, where NAME is also the node's name. A finding is a line `@ aspect peer outcome`.
`cpp_battery/src/battery_peer.cpp` does and prints the same.
"""

import contextlib
import re
import sys
import threading

from roscpp.srv import GetLoggers, SetLoggerLevel
from rosgraph_msgs.msg import Clock, TopicStatistics
from std_msgs.msg import String, UInt8MultiArray
from std_srvs.srv import SetBool, SetBoolResponse

import rospy
from roslib.message import get_message_class

PEERS = ("pipros", "rospy", "roscpp")
COUNT = 30
LARGE_BYTES = 8_000_000
CLOCK_S = 3000
"""How far each clock goes: it does not reach its end while a peer pauses before it begins to sleep."""
PATTERN = bytes(range(256)) * (LARGE_BYTES // 256)

ME = rospy.myargv()[1]
turn = threading.Lock()
said = set()


def report(aspect, peer, outcome):
    """Print a finding, once."""
    line = f"@ {aspect} {peer} {outcome}"
    with turn:
        if line not in said:
            said.add(line)
            print(line, flush=True)


def pause(seconds=0.02):
    """Wait in wall time, because the peers use simulated time; end the thread at shutdown."""
    if rospy.is_shutdown():
        sys.exit()
    rospy.rostime.wallsleep(seconds)


def wait_for_peers(publisher):
    while publisher.get_num_connections() < len(PEERS):
        pause()
    return publisher


def in_thread(function, *args):
    threading.Thread(target=function, args=args, daemon=True).start()


# -- topics --------------------------------------------------------------------------


def publish_numbers(publisher):
    wait_for_peers(publisher)
    for number in range(COUNT):
        publisher.publish(str(number))


def publish_large(publisher):
    wait_for_peers(publisher).publish(UInt8MultiArray(data=PATTERN))


def tick(publisher):
    while True:
        publisher.publish("tick")
        pause(0.01)


class Numbers:
    """Check that all numbers arrive in order."""

    def __init__(self, aspect, peer):
        self.aspect, self.peer, self.numbers = aspect, peer, []

    def __call__(self, message):
        self.numbers.append(int(message.data))
        header = message._connection_header
        if self.numbers == list(range(COUNT)):
            report(self.aspect, self.peer, f"{COUNT} in order, {header['type']} from {header['callerid']}")
        if self.aspect == "plain" and len(self.numbers) == 1:
            # the latched message is older than this message
            rospy.Subscriber("latched/" + self.peer, String, hear_latched, self.peer)


def hear_latched(message, peer):
    report("latched", peer, f"{message.data}, latching={message._connection_header['latching']}")


def hear_large(message, peer):
    report("large", peer, "intact" if message.data == PATTERN else f"broken, {len(message.data)} bytes")


def relay(message, peer):
    """Forward messages of an unknown type, with the class from the connection."""
    message_class = get_message_class(message._connection_header["type"])
    publisher = rospy.Publisher(f"relay/{ME}/{peer}", message_class, queue_size=1, latch=True)
    publisher.publish(message_class().deserialize(message._buff))
    relays.append(publisher)


def hear_relayed(message, names):
    peer, relayer = names
    report("relay", f"{peer} {relayer}", f"{message.data} from {message._connection_header['callerid']}")


def hear_statistics(message):
    topic = re.fullmatch(r"/tick/(\w+)", message.topic)
    if (
        topic
        and message.delivered_msgs > 0
        and message.traffic > 0
        and message.window_stop > message.window_start
    ):
        report("statistics", topic.group(1), f"{message.node_pub} heard by {message.node_sub}")


# -- services --------------------------------------------------------------------------


def answer(request):
    if not request.data:
        raise ValueError("refused")
    header = request._connection_header
    return SetBoolResponse(True, f"{ME} to {header['callerid']}, persistent={header.get('persistent', '0')}")


def call_services(server):
    name = f"/{server}/answer"
    rospy.wait_for_service(name)
    call = rospy.ServiceProxy(name, SetBool)
    report("service", server, call(True).message)
    try:
        call(False)
    except rospy.ServiceException:
        report("service_error", server, "ServiceException")
    call = rospy.ServiceProxy(name, SetBool, persistent=True)
    said = {call(True).message for _ in range(3)}
    try:
        call(False)
    except rospy.ServiceException:
        said.add(call(True).message)  # the connection has survived the error
    report("persistent", server, " | ".join(said))
    call.close()


def set_loggers(server):
    rospy.wait_for_service(f"/{server}/set_logger_level")
    get_loggers = rospy.ServiceProxy(f"/{server}/get_loggers", GetLoggers)
    set_level = rospy.ServiceProxy(f"/{server}/set_logger_level", SetLoggerLevel)
    logger = ("ros." if server == "roscpp" else "rosout.") + ME
    for level in ("warn", "error"):
        set_level(logger, level.upper())
        if level not in [item.level.lower() for item in get_loggers().loggers if item.name == logger]:
            report("loggers", server, level + " was not set")
    report("loggers", server, "followed")


# -- parameters and time -------------------------------------------------------------------


def set_parameter():
    number = 0
    while True:
        number += 1
        rospy.set_param(f"/matrix/{ME}", number)
        pause(0.1)


def follow_parameter(peer):
    first = None
    while True:
        value = rospy.get_param_cached(f"/matrix/{peer}", None)
        if first is None:
            first = value
        elif value >= first + 3:
            return report("parameters", peer, "followed")
        pause()


def simulate_time(clock, seen):
    """Run the clock from CLOCK_S, its double or its triple, after the peer whose turn is earlier."""
    wait_for_peers(clock)
    number = PEERS.index(ME)
    while len(seen[number - 1]) < len(PEERS):  # the last entry: all are ready
        pause()
    now, last = CLOCK_S * (number + 1), CLOCK_S * (number + 2) - 1
    is_last = number == len(PEERS) - 1
    while is_last or len(seen[number]) < len(PEERS):
        now = now + 1 if is_last or now < last else now
        clock.publish(rospy.Time(now))
        pause(0.005)


def see_time(publisher):
    wait_for_peers(publisher)
    # roscpp publishes its statistics from within publish(), once time goes on, and hangs when it is
    # subscribing to something meanwhile: time begins when all subscriptions have been made.
    while sum(line.startswith("@ latched") for line in list(said)) < len(PEERS):
        pause()
    publisher.publish(f"{len(PEERS)} {ME}")
    for number, peer in enumerate(PEERS):
        begin = rospy.Time(CLOCK_S * (number + 1))
        while rospy.Time.now() < begin:
            # The last message of one clock may arrive after the first of the next.
            with contextlib.suppress(rospy.ROSTimeMovedBackwardsException):
                rospy.sleep(1)
        report("clock", peer, "slept")
        publisher.publish(f"{number} {ME}")


relays = []


def main():
    rospy.init_node(ME)
    latched = rospy.Publisher("latched/" + ME, String, queue_size=1, latch=True)
    latched.publish("old")
    latched.publish("newest")
    rospy.Publisher("relayed/" + ME, String, queue_size=1, latch=True).publish("sent by " + ME)
    rospy.Service("~answer", SetBool, answer)
    seen = [set() for _ in range(len(PEERS) + 1)]
    rospy.Subscriber("seen", String, lambda message: seen[int(message.data[0])].add(message.data))
    rospy.Subscriber("statistics", TopicStatistics, hear_statistics)
    for peer in PEERS:
        rospy.Subscriber("plain/" + peer, String, Numbers("plain", peer))
        rospy.Subscriber("nodelay/" + peer, String, Numbers("nodelay", peer), tcp_nodelay=True)
        rospy.Subscriber("large/" + peer, UInt8MultiArray, hear_large, peer)
        rospy.Subscriber("tick/" + peer, String)
        rospy.Subscriber("relayed/" + peer, rospy.AnyMsg, relay, peer)
        for relayer in PEERS:
            rospy.Subscriber(f"relay/{relayer}/{peer}", String, hear_relayed, (peer, relayer))
        for task in (call_services, set_loggers, follow_parameter):
            in_thread(task, peer)
    in_thread(publish_numbers, rospy.Publisher("plain/" + ME, String, queue_size=COUNT))
    in_thread(publish_numbers, rospy.Publisher("nodelay/" + ME, String, queue_size=None, tcp_nodelay=True))
    in_thread(publish_large, rospy.Publisher("large/" + ME, UInt8MultiArray, queue_size=1))
    in_thread(tick, rospy.Publisher("tick/" + ME, String, queue_size=10))
    in_thread(set_parameter)
    in_thread(simulate_time, rospy.Publisher("/clock", Clock, queue_size=10), seen)
    in_thread(see_time, rospy.Publisher("seen", String, queue_size=10))
    rospy.spin()


main()

"""Latched topics with several subscribers, and the members of `Publisher.impl` and `Subscriber.impl`."""

import gc
import weakref

from examination import begin, examine, wait_for
from std_msgs.msg import Int32, String

import rospy

events = []


class Ear(rospy.SubscribeListener):
    def __init__(self, name):
        self.name = name

    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        events.append((self.name, "come", topic_name))

    def peer_unsubscribe(self, topic_name, num_peers):
        events.append((self.name, "gone", topic_name, num_peers))


def latched_topics():
    publisher = rospy.Publisher("latched", String, queue_size=5, latch=True)
    publisher.publish("one")
    first, second = [], []
    rospy.Subscriber("latched", String, first.append)
    wait_for(lambda: first)
    rospy.Subscriber("latched", String, lambda m, extra: second.append((m.data, extra)), "extra")
    examine("second subscriber", lambda: second)
    examine("wait_for_message", lambda: rospy.wait_for_message("latched", String, 60).data)
    examine("wait_for_message in a callback", wait_in_a_callback)
    examine("what came", lambda: ([m.data for m in first], second))
    silent = rospy.Publisher("silent", Int32, queue_size=5)
    heard, late = [], []
    rospy.Subscriber("silent", Int32, heard.append)
    wait_for(silent.get_num_connections)
    silent.publish(1)
    wait_for(lambda: heard)
    rospy.Subscriber("silent", Int32, late.append)
    silent.publish(2)
    wait_for(lambda: late)
    examine("not latched", lambda: [m.data for m in late])


def wait_in_a_callback():
    got = []
    topic = rospy.Publisher("inner", String, queue_size=5, latch=True)
    topic.publish("x")
    rospy.Subscriber("inner", String, lambda _: got.append(rospy.wait_for_message("inner", String, 60).data))
    wait_for(lambda: got)
    return got


def impls():
    publisher = rospy.Publisher("t", String, queue_size=5, latch=True)
    publisher.publish("one")
    got = []
    subscriber = rospy.Subscriber("t", String, got.append)
    other = rospy.Subscriber("t", String, lambda m, extra: None, "extra")
    wait_for(lambda: got)
    examine("reg_type", lambda: (publisher.reg_type, subscriber.reg_type))
    examine("is_latch", lambda: publisher.impl.is_latch)
    for side, impl in (("pub", publisher.impl), ("sub", subscriber.impl)):
        examine(f"{side} names", lambda: (impl.resolved_name, impl.name, impl.type, impl.data_class._type))
        examine(f"{side} number", lambda: (impl.get_num_connections(), impl.has_connections()))
        peers = ("/ns/probe", rospy.get_node_uri(), "/nobody")
        examine(f"{side} has", lambda: [impl.has_connection(peer) for peer in peers])
        examine(f"{side} connections", lambda: (type(impl.connections).__name__, len(impl.connections)))
        examine(f"{side} direction", lambda: impl.connections[0].direction)
    examine("endpoint", lambda: publisher.impl.connections[0].endpoint_id)
    examine("callerid_pub", lambda: [connection.callerid_pub for connection in subscriber.impl.connections])
    examine("shared", lambda: subscriber.impl is other.impl)
    examine("shared by publishers", lambda: publisher.impl is rospy.Publisher("t", String, queue_size=5).impl)
    examine("callbacks", lambda: [(callable(function), args) for function, args in other.impl.callbacks])
    callbacks(publisher, subscriber.impl)
    before = publisher.impl.connections
    watched = weakref.ref(subscriber.impl)
    subscriber.unregister()
    examine("unregistered", lambda: (subscriber.impl, other.impl is watched()))
    other.unregister()
    other.unregister()
    examine("all unregistered", lambda: other.impl)
    impl = None
    wait_for(lambda: (gc.collect(), watched() is None)[1])
    wait_for(lambda: not publisher.impl.connections)
    examine("the old list", lambda: len(before))


def callbacks(publisher, impl):
    got, pairs = [], []
    examine("add_callback", lambda: impl.add_callback(got.append, None))
    examine("latched at once", lambda: [m.data for m in got])
    publisher.publish("two")
    wait_for(lambda: len(got) == 2)
    examine("remove other args", lambda: impl.remove_callback(got.append, 3))
    examine("remove", lambda: impl.remove_callback(got.append, None))
    examine("remove again", lambda: impl.remove_callback(got.append, None))

    def keep(message, extra):
        pairs.append((message.data, extra))

    impl.add_callback(keep, 7)
    examine("with args", lambda: pairs)
    examine("remove with args", lambda: impl.remove_callback(keep, 7))
    examine("left", lambda: len(impl.callbacks))


def listeners():
    publisher = rospy.Publisher("heard", String, queue_size=1, subscriber_listener=Ear("first"))
    later = Ear("later")
    subscriber = rospy.Subscriber("heard", String)
    wait_for(lambda: events)
    examine("add_subscriber_listener", lambda: publisher.impl.add_subscriber_listener(later))
    subscriber.unregister()
    wait_for(lambda: len(events) == 3)
    examine("listeners", lambda: len(publisher.impl.subscriber_listeners))
    publisher.impl.subscriber_listeners.remove(later)
    subscriber = rospy.Subscriber("heard", String)
    wait_for(lambda: len(events) == 4)
    examine("events", lambda: sorted(events))
    publisher.unregister()
    examine("unregistered", lambda: publisher.impl)


def any_messages():
    for value in (b"abc", "text", None, 5, bytearray(b"x")):
        examine(f"AnyMsg of {value}", lambda: rospy.AnyMsg().deserialize(value)._buff)


def main():
    rospy.init_node("probe", disable_signals=True)
    for part in (latched_topics, impls, listeners, any_messages):
        begin(part.__name__)
        part()


main()

"""`rosrun tf tf_monitor`: print delays and rates of all transforms, or only those between two frames."""

from __future__ import annotations

import threading
from typing import Any

import rospy
import tf2_ros
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.printable import listed, printable
from pipros.msg import load_message_class
from pipros_libraries.transforms.diagnose import UNKNOWN_SENDER
from pipros_libraries.transforms.monitor import Monitor, TransformDelays
from tf.transformer import strip_leading_slash

PRINT_S = 0.25


class Watch:
    """Statistics on received transforms, updated by callbacks in the connections' threads.

    Attributes:
        pair: source and target frame to report on, or None for all frames.
    """

    def __init__(self, pair: tuple[str, str] | None) -> None:
        self.pair = pair
        self.buffer = tf2_ros.Buffer(debug=False)
        self._net = TransformDelays()
        self._monitor = Monitor()
        self._lock = threading.Lock()
        self._listener = tf2_ros.TransformListener(self.buffer)
        kind: Any = load_message_class("tf2_msgs/TFMessage")
        for topic in ("/tf", "/tf_static"):
            rospy.Subscriber(topic, kind, self._on_message, queue_size=100)

    def _on_message(self, message: Any) -> None:
        now = rospy.get_time()
        sender = printable(message._connection_header.get("callerid", UNKNOWN_SENDER))
        stamps = {
            printable(strip_leading_slash(transform.child_frame_id)): transform.header.stamp.to_sec()
            for transform in message.transforms
        }
        with self._lock:
            self._monitor.add(sender, stamps, now)
            if self.pair is not None:
                try:
                    latest = self.buffer.get_latest_common_time(*self.pair)
                except tf2_ros.TransformException:
                    return
                self._net.add(now - latest.to_sec(), now)

    def wait_for_chain(self) -> None:
        """Wait indefinitely until the frames are connected. Raises ROSInterruptException on shutdown."""
        if self.pair is None:
            return
        source, target = self.pair
        print(f"Waiting for transform chain to become available between {source} and {target} ", flush=True)
        while not self.buffer.can_transform(source, target, rospy.Time(), rospy.Duration(1.0)):
            pass

    def text(self) -> str:
        """Return the report. Raises `tf2_ros.TransformException` if the frames are not connected."""
        if self.pair is None:
            with self._lock:
                return f"\n\n\nRESULTS: for all Frames\n\n{self._monitor.text()}"
        source, target = self.pair
        chain = self.buffer._chain(target, rospy.Time(), source, rospy.Time(), source)
        ends = [*chain, *(frame for frame in (source, target) if frame not in chain)]
        order = ends if ends[0] == source else ends[::-1]
        with self._lock:
            return (
                f"\n\n\nRESULTS: for {source} to {target}\nChain is: {' -> '.join(map(listed, order))}\n"
                f"Net delay     avg = {self._net.average:g}: max = {self._net.maximum:g}\n\n"
                f"{self._monitor.text(order)}"
            )


@exits_after_ctrl_c()
def main() -> int:
    """Print reports until the node is shut down. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) not in (0, 2):
        print("TF_Monitor: usage: tf_monitor framea frameb")
        return 255
    rospy.init_node("tf_monitor", anonymous=True)
    source, target = map(strip_leading_slash, arguments or ("", ""))
    watch = Watch((source, target) if arguments else None)
    try:
        watch.wait_for_chain()
        pause = rospy.Rate(1.0 / PRINT_S, reset=True)
        while not rospy.is_shutdown():
            pause.sleep()
            try:
                print(watch.text(), flush=True)
            except tf2_ros.TransformException as error:
                print(f"Transform Exception {listed(error)}", flush=True)
    except rospy.ROSInterruptException:
        pass
    return 0

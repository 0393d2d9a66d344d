"""The messages in the transcripts of `rostopic echo`, each on a latched topic, and a few services.

Run as a program, it is a node that publishes them, on genuine ROS and on pipros.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def messages() -> dict[str, Any]:
    """Return the message of each topic."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
    from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
    from sensor_msgs.msg import Image, LaserScan
    from std_msgs import msg as std

    from rospy import Duration, Time

    header = std.Header(stamp=Time(1000, 5), frame_id="laser")
    return {
        "/text": std.String("hello"), "/odd_text": std.String('grüß "dich"\nzweimal \\'),
        "/empty_text": std.String(""), "/int": std.Int32(7), "/float": std.Float32(0.1),
        "/double": std.Float64(-1234.56789), "/bool": std.Bool(True), "/nothing": std.Empty(),
        "/time": std.Time(Time(12, 34)), "/duration": std.Duration(Duration(-1, 5)),
        "/color": std.ColorRGBA(0.5, 1, 0, 1), "/header": header,
        "/numbers": std.Float64MultiArray(data=[1.0, 2.5, -3.0]),
        "/scan": LaserScan(header=header, angle_min=-0.5, ranges=[0.5, 1.25, float("inf")]),
        "/image": Image(header=header, height=1, width=3, encoding="mono8", data=b"abc"),
        "/pose": PoseStamped(
            header=header, pose=Pose(position=Point(1.0, 1.5, -2.0), orientation=Quaternion(0, 0, 0, 1))
        ),
        "/diagnostics": DiagnosticArray(
            status=[
                DiagnosticStatus(
                    name="motor", message='so "so"', values=[KeyValue("volt", "12"), KeyValue("", "x")]
                ),
                DiagnosticStatus(level=2, name="arm"),
            ]
        ),
    }  # fmt: skip


def services() -> dict[str, tuple[Any, Callable[[Any], Any]]]:
    """Return the class and the handler of each service."""
    from nav_msgs.srv import GetPlan, GetPlanResponse
    from std_srvs.srv import Empty, EmptyResponse, SetBool, SetBoolResponse

    def fail(_request: Any) -> Any:
        raise ValueError("boom")

    return {
        "/served/empty": (Empty, lambda request: EmptyResponse()),
        "/served/set": (SetBool, lambda request: SetBoolResponse(request.data, f"got {request.data}")),
        "/served/plan": (GetPlan, lambda request: GetPlanResponse()),
        "/served/fail": (Empty, fail),
    }


def main() -> None:
    import rospy

    rospy.init_node("source")
    for service, (service_class, handler) in services().items():
        rospy.Service(service, service_class, handler)
    publishers = []
    for topic, message in messages().items():
        publishers.append(rospy.Publisher(topic, type(message), latch=True, queue_size=1))
        publishers[-1].publish(message)
    rospy.spin()


if __name__ == "__main__":
    main()

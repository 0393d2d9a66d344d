"""Numbers in headers of services, and types and elements of topics."""

import contextlib
import io

from examination import begin, examine, wait_for
from geometry_msgs.msg import Point, PointStamped, Polygon
from sensor_msgs.msg import ChannelFloat32, PointCloud
from std_msgs.msg import Header, String
from std_srvs.srv import Trigger

import rospy
import rostopic


class Stamped:
    """A service whose request and response begin with a header."""

    _type = "nowhere/Stamped"
    _md5sum = "0123456789abcdef0123456789abcdef"
    _request_class = PointStamped
    _response_class = PointStamped


def headers():
    got = []

    def serve(request):
        got.append((request.header.seq, request.header.frame_id))
        if request.point.x < 0:
            raise ValueError("negative")
        return PointStamped(Header(seq=70, frame_id=None), request.point)

    rospy.Service("~stamped", Stamped, serve)
    for persistent in (False, True):
        proxy = rospy.ServiceProxy("~stamped", Stamped, persistent=persistent)
        for x in (1, -1, 2, 3):
            request = PointStamped(Header(seq=50), Point(x, 0, 0))

            def called():
                answer = proxy(request)
                return answer.header.seq, answer.header.frame_id, request.header.seq

            examine(f"call {persistent} {x}", called)
    examine("served", lambda: got)
    rospy.Service("~plain", Trigger, lambda _: (True, "fine"))
    examine("plain", lambda: rospy.ServiceProxy("~plain", Trigger)().message)


def types():
    publisher = rospy.Publisher("/some/text", String, queue_size=1, latch=True)
    publisher.publish("x")
    wait_for(lambda: rostopic.get_topic_type("/some/text")[0])
    for name in (
        "some/text", "text", "/some/text", "/some/text/data", "some/text/data", "", "/", "/some/none",
    ):  # fmt: skip
        examine(f"type {name}", lambda: rostopic.get_topic_type(name)[:2])
        examine(f"class {name}", lambda: [str(one) for one in rostopic.get_topic_class(name)[1:2]])


def elements():
    three = [ChannelFloat32(values=[float(n) for n in range(length)]) for length in (8, 2, 7)]
    message = PointCloud(channels=three)
    for part in (
        *(
            "[:]/values[6]", "[:]/values[1]", "[1:]/values[6]", "[:]/values", "[:]/values[20]",
            "[0]/values[6]",
        ),
        *("[1]/values[6]", "[5]", "[:]/values[0:2]", "[:]/none", "[:2]/values[-8]", "[:]/values[5:9]"),
    ):  # fmt: skip

        def evaluated():
            with contextlib.redirect_stderr(io.StringIO()):
                return rostopic.msgevalgen(f"/channels{part}")(message)

        examine(part, evaluated)
    points = Polygon(points=[Point(1, 2, 3), Point(4, 5, 6)])
    for path in ("/points[:]/x", "/points[1:]/z", "/points[:]", "/points[9:]/x"):
        examine(path, lambda: str(rostopic.msgevalgen(path)(points)))


begin("elements")
elements()
rospy.init_node("probe", disable_signals=True)
for part in (headers, types):
    begin(part.__name__)
    part()

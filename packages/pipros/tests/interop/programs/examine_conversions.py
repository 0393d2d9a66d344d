"""Print as JSON the results of tf_conversions for random poses. Argument: a seed."""

import json
import random
import sys

import numpy
from geometry_msgs.msg import Point, Pose, Quaternion

import tf_conversions
from tf import transformations

draw = random.Random(int(sys.argv[1]))  # noqa: S311 # no secret
found = []
for _ in range(50):
    position = [draw.uniform(-5, 5) for _ in range(3)]
    quaternion = transformations.random_quaternion([draw.random() for _ in range(3)]).tolist()
    frame = tf_conversions.fromTf((position, quaternion))
    message = tf_conversions.toMsg(tf_conversions.fromMsg(Pose(Point(*position), Quaternion(*quaternion))))
    matrix = tf_conversions.toMatrix(frame)
    again = tf_conversions.toMatrix(tf_conversions.fromMatrix(matrix * 1.0))
    turned = tf_conversions.Rotation.RPY(*position)
    found.append([[list(part) for part in tf_conversions.toTf(frame)], matrix.tolist(), again.tolist()])
    found.append([message.position.x, message.orientation.x, message.orientation.w, list(turned.GetRPY())])

    class Camera:
        def Rodrigues2(self, vector, into):  # noqa: N802
            into[:] = numpy.diag(vector)

    camera = tf_conversions.fromCameraParams(Camera(), position, numpy.array([[1.0], [2.0], [3.0]]))
    found.append([list(camera.p), [camera.M[row, row] for row in range(3)]])
json.dump(
    [found, sorted(name for name in vars(tf_conversions) if name[0].isupper() or name[:2] in ("to", "fr"))],
    sys.stdout,
)

"""Print as JSON the results of every function of tf.transformations for random arguments.

Arguments: a seed and how often each function is called. Runs under either implementation.
"""

import json
import sys
import warnings

import numpy

from tf import transformations as tf

AXES = [
    "%s%s" % (frame, order)
    for frame in "sr"
    for order in (["xyz", "xyx", "xzy", "xzx", "yzx", "yzy", "yxz", "yxy", "zxy", "zxz", "zyx", "zyz"])
]


def flat(value):
    """Return numbers, strings and lists for a result with any sequence types."""
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, (list, tuple, numpy.ndarray)):
        return [flat(part) for part in value]
    if isinstance(value, (numpy.bool_, numpy.integer)):
        return value.item()
    return float(value)


def outcome(function, *arguments, **more):
    """Return the result, or the name of the exception."""
    try:
        return flat(function(*arguments, **more))
    except Exception as error:
        return "raises " + type(error).__name__


def call(label, *arguments):
    """Return the label, whose first word is the name of a function, and the outcome of a call."""
    return label, outcome(getattr(tf, label.split()[0]), *arguments)


def calls(label, *arguments):
    return label, [call(label, *each)[1] for each in arguments]


def one_sign(vector):
    """Normalise the sign of an eigenvector so that its largest number is positive."""
    return vector * numpy.sign(vector[numpy.argmax(numpy.abs(vector))])


def pair_of_signs(angle_and_vector):
    """Normalise an angle and its axis, both of which may have the opposite sign."""
    vector = angle_and_vector[1]
    sign = numpy.sign(vector[numpy.argmax(numpy.abs(vector))])
    return [angle_and_vector[0] * sign, vector * sign]


def on_plane(point, normal):
    """Return the normal and offset of a plane, the same for all its points."""
    return numpy.dot(point[:3], normal) / point[3]


def examine(draw):
    """Yield (name, result) of calls with arguments that `draw` makes."""
    v = lambda size=3: draw.uniform(-2, 2, size)
    unit = lambda: tf.unit_vector(draw.normal(size=3))
    quaternion = lambda: tf.unit_vector(draw.normal(size=4))
    angle = float(draw.uniform(-3, 3))
    axes = AXES[draw.randint(len(AXES))]
    point, direction, normal, eye = v(), v(), v(), v() * 5
    q0, q1 = quaternion(), quaternion()
    angles = draw.uniform(-3, 3, 3)
    shape = draw.normal(size=(4, 3, 2))
    rand = draw.uniform(0, 1, 3)

    yield call("identity_matrix")
    yield call("translation_matrix", point)
    yield call("translation_from_matrix", tf.translation_matrix(point))
    mirror = tf.reflection_matrix(point, normal)
    yield "reflection_matrix", flat(mirror)
    yield call("reflection_matrix 4", list(point) + [1], list(normal) + [0])

    def mirrored():
        at, across = tf.reflection_from_matrix(mirror)
        across = one_sign(across)
        return [across, on_plane(at, across)]

    yield "reflection_from_matrix", outcome(mirrored)
    yield call("reflection_from_matrix of a rotation", tf.rotation_matrix(angle, direction))
    for name, where in (("", None), (" at", point)):
        turned = tf.rotation_matrix(angle, direction, where)
        yield "rotation_matrix" + name, flat(turned)

        def turning():
            by, around, at = tf.rotation_from_matrix(turned)
            moved = numpy.dot(turned, at) - at
            return pair_of_signs((by, around)) + [numpy.allclose(moved, 0)]

        yield "rotation_from_matrix" + name, outcome(turning)
    yield (
        "rotation_from_matrix of axes",
        [
            outcome(lambda: pair_of_signs(tf.rotation_from_matrix(tf.rotation_matrix(angle, axis))[:2]))
            for axis in numpy.identity(3)
        ],
    )
    yield call("rotation_from_matrix of a mirror", -tf.identity_matrix())
    factor = float(draw.uniform(-3, 3))
    for origin in (None, point):
        for along in (None, direction):
            scaling = tf.scale_matrix(factor, origin, along)
            yield "scale_matrix", flat(scaling)

            def scaled():
                by, at, way = tf.scale_from_matrix(scaling)
                fixed = numpy.allclose(numpy.dot(scaling, at), at)
                return [by, fixed, None if way is None else one_sign(way)]

            yield "scale_from_matrix", outcome(scaled)
    for arguments in (
        (point, normal), (point, normal, direction), (point, normal, None, eye),
        (point, normal, None, eye, True),
    ):  # fmt: skip
        projection = tf.projection_matrix(*arguments)
        yield "projection_matrix", flat(projection)
        pseudo = len(arguments) > 4

        def projected():
            found = tf.projection_from_matrix(projection, pseudo)
            signs = [
                one_sign(part) if index in (1, 2) and part is not None else part
                for index, part in enumerate(found)
            ]
            signs[0] = None
            return signs + [tf.is_same_transform(tf.projection_matrix(*found), projection)]

        yield "projection_from_matrix %d" % len(arguments), outcome(projected)
    near = float(draw.uniform(0.1, 1))
    bounds = numpy.sort(draw.uniform(-3, 3, (2, 2)), axis=1)
    for perspective in (False, True):
        yield call("clip_matrix", *(list(bounds.flat) + [near, near + 1, perspective]))
    yield calls("clip_matrix refused", (1, 0, 0, 1, 1, 2), (0, 1, 0, 1, 0, 2, True))
    along = numpy.cross(direction, normal)
    slope = float(draw.uniform(0.1, 1.4))
    shearing = tf.shear_matrix(slope, along, point, normal)
    yield "shear_matrix", flat(shearing)
    yield call("shear_matrix refused", angle, normal, point, normal)

    def sheared():
        by, way, at, across = tf.shear_from_matrix(shearing)
        return [by, tf.is_same_transform(tf.shear_matrix(by, way, at, across), shearing)]

    yield "shear_from_matrix", outcome(sheared)
    yield call("shear_from_matrix refused", 2 * tf.random_rotation_matrix(rand))
    scale, shear, perspective = draw.uniform(0.2, 2, 3), v(), list(v() * 0.1) + [1]
    for parts in (
        (scale, shear, angles, point), (scale, shear, angles, point, perspective), (-scale, None, angles),
        (scale,), (),
    ):  # fmt: skip
        whole = tf.compose_matrix(*parts)
        yield "compose_matrix", flat(whole)
        yield call("decompose_matrix", whole)
    yield call("decompose_matrix upright", tf.euler_matrix(0.3, numpy.pi / 2, 0.2))
    yield calls("decompose_matrix refused", (numpy.zeros((4, 4)),), (numpy.diag((1, 0, 1, 1)),))
    yield call("orthogonalization_matrix", draw.uniform(1, 9, 3), draw.uniform(80, 100, 3))
    cloud = v((3, 7))
    moved = (
        numpy.dot(tf.random_rotation_matrix(rand)[:3, :3], cloud) * 2
        + v((3, 1))
        + draw.normal(size=(3, 7)) * 0.01
    )
    for svd in (True, False):
        for scaled in (True, False):
            yield call("superimposition_matrix", cloud, moved, scaled, svd)
            yield call("superimposition_matrix mirrored", cloud, -moved, scaled, svd)
    yield call("superimposition_matrix refused", cloud[:, :2], moved[:, :2])
    for name in (axes, tf._AXES2TUPLE[axes]):
        matrix = tf.euler_matrix(angles[0], angles[1], angles[2], name)
        yield "euler_matrix " + axes, flat(matrix)
        yield "euler_from_matrix " + axes, outcome(tf.euler_from_matrix, matrix, name)
        yield (
            "euler_from_matrix upright " + axes,
            outcome(tf.euler_from_matrix, tf.euler_matrix(angles[0], 0, angles[2], name), name),
        )
        yield (
            "quaternion_from_euler " + axes,
            outcome(tf.quaternion_from_euler, angles[0], angles[1], angles[2], name),
        )
        yield "euler_from_quaternion " + axes, outcome(tf.euler_from_quaternion, q0, name)
    yield "unknown axes", [outcome(f, 1, 2, 3, "xyz") for f in (tf.euler_matrix, tf.quaternion_from_euler)]
    yield (
        "unknown axes of a matrix",
        [
            outcome(tf.euler_from_matrix, tf.identity_matrix(), (9, 9, 9, 9)),
            outcome(tf.euler_from_quaternion, q0, "abc"),
        ],
    )
    yield (
        "quaternion_about_axis",
        [outcome(tf.quaternion_about_axis, angle, a) for a in (direction, (0, 0, 0), list(direction) + [7])],
    )
    for q in (q0, q0 * 3, (0, 0, 0, 0), (0, 0, 0, 1), list(q1)):
        yield call("quaternion_matrix", q)
        yield call("quaternion_from_matrix", tf.quaternion_matrix(q))
        yield call("quaternion_conjugate", q)
    for half in ((1, 0, 0), (0, 1, 0), (0, 0, 1), direction):
        yield call("quaternion_from_matrix of half a turn", tf.rotation_matrix(numpy.pi - 1e-3, half))
    yield call("quaternion_inverse", q0 * 2)
    yield call("quaternion_multiply", q0, list(q1))
    for fraction in (0.0, 1.0, rand[0], -0.5):
        for spin in (0, 1):
            for shortest in (True, False):
                yield call("quaternion_slerp", q0, q1 * 2, fraction, spin, shortest)
    yield calls("quaternion_slerp of one", (q0, q0, 0.5), (q0, -q0, 0.5))
    yield call("random_quaternion", rand)
    yield call("random_rotation_matrix", rand)
    numpy.random.seed(int(rand[0] * 1e6))
    yield (
        "random ones",
        [
            outcome(tf.random_quaternion), outcome(tf.random_rotation_matrix), outcome(tf.random_vector, 5),
            outcome(tf.random_vector, (2, 2)),
        ],
    )  # fmt: skip

    def balls():
        found = []
        for ball in (
            tf.Arcball(), tf.Arcball(q0), tf.Arcball(tf.quaternion_matrix(q0)),
            tf.Arcball(initial=numpy.identity(4)),
        ):  # fmt: skip
            ball.place([300, 310], 320)
            if len(found) % 2:
                ball.setaxes(unit(), unit())
                ball.setconstrain(True)
            for _ in range(3):
                ball.down(draw.uniform(0, 640, 2))
                ball.drag(draw.uniform(0, 640, 2))
                found.append(ball.matrix())
                ball.next()
                ball.next(0.1)
                found.append(ball.matrix())
            found.append(ball.getconstrain())
            ball.setconstrain(False)
            ball.down((100, 100))
            ball.drag((500, 400))
            found.append(ball.matrix())
        return found

    yield "Arcball", outcome(balls)
    yield call("Arcball refused", (1, 2, 3))
    yield (
        "arcball_map_to_sphere",
        [outcome(tf.arcball_map_to_sphere, draw.uniform(0, 640, 2), (320, 320), r) for r in (10, 400)],
    )
    around = unit()
    yield calls("arcball_constrain_to_axis", (unit(), around), (around, around), ((0, 0, 1), (0, 0, 1)))
    yield call("arcball_nearest_axis", unit(), [unit(), unit(), unit()])
    for axis in (None, 0, 1, 2, -1):
        yield call("vector_norm", shape, axis)
        yield call("unit_vector", shape, axis)
    out = numpy.empty((4, 3))
    yield "vector_norm out", [outcome(tf.vector_norm, shape, 2, out), flat(out)]
    out = numpy.empty((4, 3, 2))
    yield "unit_vector out", [outcome(tf.unit_vector, shape, 1, out), flat(out)]
    yield "unit_vector in place", [outcome(tf.unit_vector, out, 2, out), flat(out)]
    yield (
        "norms of lists",
        [
            outcome(tf.vector_norm, [1, 2, 3]), outcome(tf.unit_vector, [1, 2, 3]),
            outcome(tf.vector_norm, []), outcome(tf.unit_vector, []),
        ],
    )  # fmt: skip
    yield calls(
        "inverse_matrix",
        (tf.random_rotation_matrix(rand),),
        (numpy.diag((1.0, 2.0, 4.0)),),
        (numpy.zeros((4, 4)),),
    )
    yield calls("concatenate_matrices", (), (mirror, turned, shearing))
    yield calls("is_same_transform", (mirror, mirror * 2), (mirror, turned))


def main():
    warnings.simplefilter("ignore")
    seed, count = int(sys.argv[1]), int(sys.argv[2])
    draw = numpy.random.RandomState(seed)
    answers = [answer for _ in range(count) for answer in examine(draw)]
    names = sorted(name for name in vars(tf) if callable(getattr(tf, name)) and not name.startswith("_"))
    tables = [
        sorted((key, list(value)) for key, value in tf._AXES2TUPLE.items()), flat(tf._EPS), tf._NEXT_AXIS,
    ]  # fmt: skip
    json.dump([["names", names], ["tables", tables]] + answers, sys.stdout)


if __name__ == "__main__":
    main()

"""tf.transformations: matrices, Euler angles and quaternions."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from pipros.basics.extras import install_command
from tf import transformations as tf

DRAW = np.random.default_rng(5)


@pytest.mark.parametrize("axes", sorted(tf._AXES2TUPLE))
def test_angles_matrices_and_quaternions_of_each_convention_say_the_same(axes: str) -> None:
    angles = DRAW.uniform(0.1, 1.4, 3)

    matrix = tf.euler_matrix(*angles, axes=axes)
    quaternion = tf.quaternion_from_euler(*angles, axes=axes)

    assert np.allclose(tf.quaternion_matrix(quaternion), matrix)
    for found in (tf.euler_from_matrix(matrix, axes), tf.euler_from_quaternion(quaternion, axes)):
        assert np.allclose(tf.euler_matrix(*found, axes=axes), matrix)
    assert np.allclose(tf.euler_matrix(*angles, axes=tf._AXES2TUPLE[axes]), matrix)


def test_there_are_24_conventions() -> None:
    assert len(tf._AXES2TUPLE) == 24
    assert tf._AXES2TUPLE["sxyz"] == (0, 0, 0, 0)
    assert tf._AXES2TUPLE["rzyx"] == (0, 0, 0, 1)
    with pytest.raises(KeyError):
        tf.euler_matrix(1, 2, 3, "xyz")


def test_yaw_is_a_turn_around_z() -> None:
    quaternion = tf.quaternion_from_euler(0, 0, math.pi / 2)

    assert np.allclose(quaternion, (0, 0, math.sqrt(0.5), math.sqrt(0.5)))
    assert np.allclose(tf.quaternion_matrix(quaternion) @ (1, 0, 0, 1), (0, 1, 0, 1))


def test_a_rotation_matrix_returns_its_angle_and_axis() -> None:
    matrix = tf.rotation_matrix(0.7, (0, 0, 2), point=(1, 2, 3))

    angle, axis, point = tf.rotation_from_matrix(matrix)

    assert np.allclose(angle * axis, (0, 0, 0.7))
    assert np.allclose(matrix @ point, point)
    assert np.allclose(matrix @ (1, 2, 9, 1), (1, 2, 9, 1))


def test_a_composed_matrix_is_decomposed_again() -> None:
    parts = ((1.5, 0.5, 2), (0.1, 0.2, 0.3), (0.4, -0.5, 0.6), (7, 8, 9), (0, 0, 0, 1))

    for part, found in zip(parts, tf.decompose_matrix(tf.compose_matrix(*parts)), strict=True):
        assert np.allclose(found, part)


def test_a_mirror_a_scale_and_a_shear_are_recognised() -> None:
    point, normal = tf.reflection_from_matrix(tf.reflection_matrix((0, 0, 5), (0, 0, 1)))
    assert np.allclose((point[2], abs(normal[2])), (5, 1))

    factor, origin, direction = tf.scale_from_matrix(tf.scale_matrix(3, (1, 1, 1)))
    assert np.allclose(factor, 3)
    assert np.allclose(origin, 1)
    assert direction is None

    sheared = tf.shear_matrix(0.5, (1, 0, 0), (0, 0, 0), (0, 0, 1))
    angle, *rest = tf.shear_from_matrix(sheared)
    assert math.isclose(angle, 0.5)
    assert tf.is_same_transform(tf.shear_matrix(angle, *rest), sheared)


def test_a_projection_is_recognised() -> None:
    matrix = tf.projection_matrix((0, 0, 1), (0, 0, 1), perspective=(1, 2, 9))

    found = tf.projection_from_matrix(matrix)

    assert np.allclose(found[3], (1, 2, 9))
    assert tf.is_same_transform(tf.projection_matrix(*found), matrix)


@pytest.mark.parametrize("usesvd", [True, False])
def test_moved_points_are_brought_back(usesvd: bool) -> None:
    points = DRAW.uniform(-1, 1, (3, 6))
    matrix = tf.concatenate_matrices(tf.translation_matrix((1, 2, 3)), tf.random_rotation_matrix())
    moved = matrix[:3, :3] @ points * 2 + matrix[:3, 3:]

    found = tf.superimposition_matrix(points, moved, scaling=True, usesvd=usesvd)

    assert np.allclose(found[:3, :3] @ points + found[:3, 3:], moved)


def test_halfway_between_two_turns_is_half_a_turn() -> None:
    halfway = tf.quaternion_slerp((0, 0, 0, 1), tf.quaternion_about_axis(1.0, (1, 0, 0)), 0.5)

    assert np.allclose(halfway, tf.quaternion_about_axis(0.5, (1, 0, 0)))
    assert np.allclose(tf.quaternion_multiply(halfway, tf.quaternion_inverse(halfway)), (0, 0, 0, 1))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: tf.reflection_from_matrix(tf.identity_matrix()),
        lambda: tf.rotation_from_matrix(-tf.identity_matrix()),
        lambda: tf.shear_matrix(0.5, (0, 0, 1), (0, 0, 0), (0, 0, 1)),
        lambda: tf.decompose_matrix(np.zeros((4, 4))),
        lambda: tf.clip_matrix(1, 0, 0, 1, 1, 2),
        lambda: tf.superimposition_matrix(np.ones((3, 2)), np.ones((3, 2))),
        lambda: tf.random_quaternion((1, 2)),
        lambda: tf.Arcball((1, 2, 3)),
    ],
)
def test_invalid_arguments_are_refused(wrong: object) -> None:
    assert callable(wrong)
    with pytest.raises(ValueError, match="must"):
        wrong()


def test_without_numpy_common_functions_of_quaternions_work_and_the_error_for_others_names_the_extra() -> (
    None
):
    program = (
        "import sys; sys.modules['numpy'] = None\n"
        "import tf\nfrom tf.transformations import quaternion_from_euler, quaternion_inverse\n"
        "turned = quaternion_from_euler(0.1, 0.2, 0.3)\n"
        "back = tf.transformations.quaternion_multiply(turned, quaternion_inverse(turned))\n"
        "print(*turned, *back, *tf.transformations.euler_from_quaternion(turned, 'rxyz'))\n"
        "try:\n    from tf.transformations import euler_matrix\n"
        "except ImportError as error:\n    print(error)"
    )

    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)

    numbers, error = ended.stdout.splitlines()
    turned = tf.quaternion_from_euler(0.1, 0.2, 0.3)
    expected = (*turned, 0.0, 0.0, 0.0, 1.0, *tf.euler_from_quaternion(turned, "rxyz"))
    assert [float(number) for number in numbers.split()] == pytest.approx(expected, abs=1e-15)
    assert error.startswith("tf.transformations needs numpy")
    assert install_command("numpy") in error

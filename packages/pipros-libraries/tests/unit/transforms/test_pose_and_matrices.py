"""`transforms.pose` and `transforms.matrices` compute the same, one without numpy and one with it."""

import math
import random

import numpy as np
import pytest

from pipros_libraries.transforms.matrices.affine import translation_matrix
from pipros_libraries.transforms.matrices.euler import euler_from_matrix
from pipros_libraries.transforms.matrices.quaternions import (
    quaternion_from_euler,
    quaternion_from_matrix,
    quaternion_matrix,
    quaternion_slerp,
)
from pipros_libraries.transforms.pose import (
    IDENTITY,
    Pose,
    composed,
    from_roll_pitch_yaw,
    interpolate,
    inverted,
    normalized,
    roll_pitch_yaw,
    rotation_matrix,
)

_DRAW = random.Random(24)  # noqa: S311


def _random_pose() -> Pose:
    px, py, pz, qx, qy, qz, qw = (_DRAW.gauss(0.0, 1.0) for _ in range(7))
    return px, py, pz, qx, qy, qz, qw


UNIT = [normalized(_random_pose()) for _ in range(20)]
ANY_NORM = [
    *(_random_pose() for _ in range(20)),
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0),
    *((0.0, 0.0, 0.0, *axis, 0.0) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 3.0))),
]


def matrix_of(pose: Pose) -> np.ndarray:
    return np.asarray(translation_matrix(pose[:3]) @ quaternion_matrix(pose[3:]))


def same_rotation(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Whether two quaternions are equal up to their sign, which means the same rotation."""
    return abs(abs(float(np.dot(one, other))) - 1.0) < 1e-12


@pytest.mark.parametrize("pose", ANY_NORM)
def test_rotation_matrices_are_the_same_for_any_norm(pose: Pose) -> None:
    assert np.allclose(np.reshape(rotation_matrix(pose), (3, 3)), quaternion_matrix(pose[3:])[:3, :3])


@pytest.mark.parametrize("pose", ANY_NORM)
def test_normalised_quaternions_are_the_same_rotation(pose: Pose) -> None:
    assert same_rotation(normalized(pose)[3:], tuple(quaternion_from_matrix(quaternion_matrix(pose[3:]))))


@pytest.mark.parametrize("pose", ANY_NORM)
def test_angles_are_the_same(pose: Pose) -> None:
    assert roll_pitch_yaw(pose) == pytest.approx(euler_from_matrix(quaternion_matrix(pose[3:])))


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2, 0.4])
def test_angles_make_the_same_quaternion_even_at_the_poles(pitch: float) -> None:
    assert from_roll_pitch_yaw(0.3, pitch, -2.0) == pytest.approx(quaternion_from_euler(0.3, pitch, -2.0))


@pytest.mark.parametrize("inner", ANY_NORM[:20])
@pytest.mark.parametrize("angle", [0.0, 0.1, -2.0, math.pi])
def test_rotations_about_z_give_the_bits_of_the_general_formula(inner: Pose, angle: float) -> None:
    z, w = math.sin(angle / 2), math.cos(angle / 2)

    # The smallest float vanishes in every sum, but is not the zero for which products are omitted.
    assert composed((1.5, -2.5, 3.5, 0.0, 0.0, z, w), inner) == composed(
        (1.5, -2.5, 3.5, 5e-324, 0.0, z, w), inner
    )


@pytest.mark.parametrize("pose", ANY_NORM)
def test_inverses_have_the_bits_of_a_rotation_by_the_conjugate_quaternion(pose: Pose) -> None:
    px, py, pz, qx, qy, qz, qw = pose
    conjugate = (-qx, -qy, -qz, qw)

    turned = composed((0.0, 0.0, 0.0, *conjugate), (-px, -py, -pz, *IDENTITY[3:]))

    assert inverted(pose) == (*turned[:3], *conjugate)


@pytest.mark.parametrize(("outer", "inner"), [*zip(UNIT[::2], UNIT[1::2], strict=True)])
def test_compositions_inverses_and_interpolations_are_the_same(outer: Pose, inner: Pose) -> None:
    assert np.allclose(matrix_of(composed(outer, inner)), matrix_of(outer) @ matrix_of(inner))
    assert np.allclose(matrix_of(inverted(outer)), np.linalg.inv(matrix_of(outer)))
    found = interpolate(outer, inner, 0.3)
    assert same_rotation(found[3:], tuple(quaternion_slerp(outer[3:], inner[3:], 0.3)))

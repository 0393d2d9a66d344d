"""Geometric properties of matrices, quaternions, projections and the arcball."""

import math
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from pipros.basics.extras import install_command
from pipros_libraries.transforms.matrices.affine import (
    reflection_from_matrix,
    reflection_matrix,
    rotation_from_matrix,
    rotation_matrix,
    scale_from_matrix,
    scale_matrix,
    shear_from_matrix,
    shear_matrix,
)
from pipros_libraries.transforms.matrices.arcball import arcball_map_to_sphere
from pipros_libraries.transforms.matrices.arrays import (
    Array,
    concatenate_matrices,
    identity_matrix,
    inverse_matrix,
    is_same_transform,
    random_vector,
    unit_vector,
    vector_norm,
)
from pipros_libraries.transforms.matrices.composition import (
    compose_matrix,
    decompose_matrix,
    orthogonalization_matrix,
    superimposition_matrix,
)
from pipros_libraries.transforms.matrices.projections import (
    clip_matrix,
    projection_from_matrix,
    projection_matrix,
)
from pipros_libraries.transforms.matrices.quaternions import (
    quaternion_about_axis,
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_matrix,
    quaternion_multiply,
    quaternion_slerp,
    random_quaternion,
    random_rotation_matrix,
)
from tf import transformations as tf
from tf.transformations import Arcball

POINT = np.array((0.3, -1.2, 2.5))


NORMAL = np.array((1.0, 2.0, -0.5))


DIRECTION = np.array((0.2, 1.0, 0.4))


EYE = np.array((4.0, 5.0, 6.0))


DRAW = np.random.default_rng(11)


def moved(matrix: Array, point: Array) -> Array:
    """Return the point after the transform, divided by its last homogeneous coordinate."""
    homogeneous = matrix @ (*point, 1.0)
    return np.asarray(homogeneous[:3] / homogeneous[3])


def is_on_plane(point: Array) -> bool:
    return abs(float((point - POINT) @ NORMAL)) < 1e-9


@pytest.mark.parametrize(("given", "along"), [({}, NORMAL), ({"direction": DIRECTION}, DIRECTION)])
def test_a_parallel_projection_moves_points_along_the_normal_or_its_direction(given: Any, along: Any) -> None:
    matrix = projection_matrix(POINT, NORMAL, **given)
    for point in DRAW.uniform(-5, 5, (10, 3)):
        target = moved(matrix, point)
        assert is_on_plane(target)
        assert np.allclose(np.cross(target - point, along), 0)


def test_a_perspective_projection_moves_points_along_lines_from_the_eye() -> None:
    matrix = projection_matrix(POINT, NORMAL, perspective=EYE)
    for point in DRAW.uniform(-5, 5, (10, 3)):
        target = moved(matrix, point)
        assert is_on_plane(target)
        assert np.allclose(np.cross(target - EYE, point - EYE), 0, atol=1e-8)


@pytest.mark.parametrize(
    "options", [{}, {"direction": DIRECTION}, {"perspective": EYE}, {"perspective": EYE, "pseudo": True}],
    ids=["orthogonal", "oblique", "perspective", "pseudo perspective"],
)  # fmt: skip
def test_a_decomposed_projection_can_be_composed_again(options: dict[str, object]) -> None:
    matrix = projection_matrix(POINT, NORMAL, **options)  # type: ignore[arg-type]
    pseudo = "pseudo" in options

    assert is_same_transform(matrix, projection_matrix(*projection_from_matrix(matrix, pseudo)))


def test_matrices_that_do_not_project_are_refused() -> None:
    with pytest.raises(ValueError, match="no eigenvalue 0"):
        projection_from_matrix(identity_matrix())
    with pytest.raises(ValueError, match="all its eigenvalues are 0"):
        projection_from_matrix(np.zeros((4, 4)), pseudo=True)


def test_a_box_is_clipped_to_the_unit_box() -> None:
    matrix = clip_matrix(-1, 3, 2, 4, 1, 5)

    assert np.allclose(moved(matrix, np.array((-1, 2, 1))), (-1, -1, -1))
    assert np.allclose(moved(matrix, np.array((3, 4, 5))), (1, 1, 1))


def test_a_pyramid_is_clipped_to_the_unit_box() -> None:
    matrix = clip_matrix(-1, 3, 2, 4, 1, 5, perspective=True)

    assert np.allclose(moved(matrix, np.array((-1, 2, 1))), (-1, -1, -1))
    assert np.allclose(moved(matrix, np.array((3, 4, 1))), (1, 1, -1))
    assert moved(matrix, np.array((-5, 10, 5)))[2] == pytest.approx(1)


@pytest.mark.parametrize("bounds", [(3, -1, 2, 4, 1, 5), (-1, 3, 4, 2, 1, 5), (-1, 3, 2, 4, 5, 1)])
def test_swapped_bounds_of_a_view_are_refused(bounds: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="left must be < right"):
        clip_matrix(*bounds)  # type: ignore[arg-type]


def test_a_perspective_view_begins_in_front_of_the_eye() -> None:
    with pytest.raises(ValueError, match="near must be > 0"):
        clip_matrix(-1, 3, 2, 4, 0, 5, perspective=True)


def test_a_reflection_is_its_own_inverse_and_is_decomposed() -> None:
    matrix = reflection_matrix(POINT, NORMAL)

    assert np.allclose(matrix @ matrix, np.identity(4))
    assert is_same_transform(matrix, reflection_matrix(*reflection_from_matrix(matrix)))
    with pytest.raises(ValueError, match="no eigenvalue -1"):
        reflection_from_matrix(identity_matrix())


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 1, 0), (1, 0, 0), (1, 2, 3)])
def test_a_rotation_around_any_axis_is_decomposed(direction: tuple[float, ...]) -> None:
    matrix = rotation_matrix(1.1, direction, POINT)

    assert np.allclose(matrix, rotation_matrix(*rotation_from_matrix(matrix)))
    assert np.allclose(moved(matrix, POINT), POINT)


def test_a_matrix_that_does_not_rotate_is_refused() -> None:
    with pytest.raises(ValueError, match="no eigenvalue 1"):
        rotation_from_matrix(np.diag((2.0, 2.0, 2.0, 1.0)))


@pytest.mark.parametrize("direction", [None, DIRECTION], ids=["all directions", "one direction"])
def test_a_scaling_keeps_its_origin_and_is_decomposed(direction: Array | None) -> None:
    matrix = scale_matrix(-2.5, POINT, direction)

    assert np.allclose(moved(matrix, POINT), POINT)
    factor, origin, found = scale_from_matrix(matrix)
    assert is_same_transform(matrix, scale_matrix(factor, origin, found))


def test_a_scaling_without_an_origin_scales_around_zero() -> None:
    assert np.allclose(moved(scale_matrix(2.0), POINT), 2 * POINT)
    assert np.allclose(moved(scale_matrix(2.0, direction=(0, 0, 1)), POINT), POINT * (1, 1, 2))


def test_a_shear_moves_points_only_along_its_plane() -> None:
    along = np.cross(NORMAL, (0.0, 0.0, 1.0))
    matrix = shear_matrix(0.4, along, POINT, NORMAL)

    assert np.allclose(moved(matrix, POINT), POINT)
    assert np.allclose(np.cross(moved(matrix, EYE) - EYE, along), 0)
    with pytest.raises(ValueError, match="orthogonal to normal"):
        shear_matrix(0.4, NORMAL, POINT, NORMAL)


def test_a_shear_is_decomposed() -> None:
    matrix = shear_matrix(0.4, (1, 0, 0), (0, 0, 0), (0, 0, 1))

    angle, direction, point, normal = shear_from_matrix(matrix)

    assert is_same_transform(matrix, shear_matrix(angle, direction, point, normal))
    with pytest.raises(ValueError, match="eigenvalue"):
        shear_from_matrix(rotation_matrix(0.4, (0, 0, 1)))


def test_matrix_products_apply_from_right_to_left() -> None:
    turn, move = rotation_matrix(math.pi / 2, (0, 0, 1)), np.identity(4)
    move[:3, 3] = (1, 0, 0)

    assert np.allclose(moved(concatenate_matrices(turn, move), np.zeros(3)), (0, 1, 0))
    assert np.allclose(concatenate_matrices(), np.identity(4))
    assert np.allclose(inverse_matrix(turn) @ turn, np.identity(4))


def test_norms_of_one_vector_and_of_many() -> None:
    vectors = np.array(((3.0, 4.0), (0.0, 2.0)))
    out = np.zeros(2)

    assert vector_norm((3, 4)) == 5.0
    assert np.allclose(vector_norm(vectors, axis=1), (5, 2))
    assert vector_norm(vectors, axis=1, out=out) is None
    assert np.allclose(out, (5, 2))


def test_unit_vectors_can_be_made_in_place() -> None:
    vectors = np.array(((3.0, 4.0), (0.0, 2.0)))
    out = np.zeros((2, 2))

    assert unit_vector(vectors, axis=1, out=out) is None
    assert unit_vector(vectors, axis=1, out=vectors) is None
    assert np.allclose(out, ((0.6, 0.8), (0, 1)))
    assert np.allclose(vectors, out)


def test_random_numbers_have_the_requested_shape_and_range() -> None:
    drawn = random_vector((50, 2))

    assert drawn.shape == (50, 2)
    assert ((drawn >= 0) & (drawn < 1)).all()


def test_random_rotations_have_length_one_and_depend_on_their_numbers() -> None:
    assert vector_norm(random_quaternion()) == pytest.approx(1)
    assert np.allclose(random_quaternion((0.2, 0.4, 0.6)), random_quaternion((0.2, 0.4, 0.6)))
    turned = random_rotation_matrix()
    assert np.allclose(turned @ turned.T, np.identity(4))
    with pytest.raises(ValueError, match="must have 3 numbers"):
        random_quaternion((0.2, 0.4))


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)])
@pytest.mark.parametrize("angle", [0.3, 3.1, math.pi])
def test_a_quaternion_survives_conversion_to_a_matrix(angle: float, axis: tuple[float, ...]) -> None:
    quaternion = quaternion_about_axis(angle, axis)
    found = quaternion_from_matrix(quaternion_matrix(quaternion))

    assert np.allclose(found, quaternion) or np.allclose(found, -quaternion)


def test_a_quaternion_of_length_zero_does_not_rotate() -> None:
    assert np.allclose(quaternion_matrix((0, 0, 0, 0)), np.identity(4))
    assert np.allclose(quaternion_about_axis(1.0, (0, 0, 0))[:3], 0)


def test_a_quaternion_times_its_inverse_does_not_rotate() -> None:
    quaternion = quaternion_about_axis(0.8, NORMAL) * 3.0

    assert np.allclose(quaternion_multiply(quaternion, quaternion_inverse(quaternion)), (0, 0, 0, 1))


def test_slerp_turns_at_constant_speed_on_the_shorter_way() -> None:
    start, end = quaternion_about_axis(0.2, (0, 0, 1)), quaternion_about_axis(1.0, (0, 0, 1))

    assert np.allclose(quaternion_slerp(start, end, 0.25), quaternion_about_axis(0.4, (0, 0, 1)))
    assert np.allclose(quaternion_slerp(start, -end, 0.25), quaternion_about_axis(0.4, (0, 0, 1)))
    far = quaternion_slerp(start, -end, 0.5, shortestpath=False)
    assert np.allclose(far, quaternion_about_axis(0.6 - math.pi, (0, 0, 1)))


def test_slerp_returns_its_ends_and_equal_rotations_unchanged() -> None:
    start, end = quaternion_about_axis(0.2, (0, 0, 1)), quaternion_about_axis(1.0, (0, 0, 1))

    assert np.allclose(quaternion_slerp(start, end, 0.0), start)
    assert np.allclose(quaternion_slerp(start, end, 1.0), end)
    assert np.allclose(quaternion_slerp(start, start, 0.5), start)


def test_decomposing_and_composing_returns_the_matrix() -> None:
    parts = ((1.5, -0.5, 2), (0.1, 0.2, 0.3), (0.4, -0.5, 0.6), (7, 8, 9), (0.01, 0.02, 0.03, 1.2))
    matrix = compose_matrix(*parts)  # type: ignore[arg-type]

    assert is_same_transform(matrix, compose_matrix(*decompose_matrix(matrix)))
    assert np.allclose(compose_matrix(), np.identity(4))
    positive = ((1.5, 0.5, 2), *parts[1:4], (0, 0, 0, 1))
    found = decompose_matrix(compose_matrix(*positive))  # type: ignore[arg-type]
    assert all(map(np.allclose, found, positive))


@pytest.mark.parametrize(("matrix", "message"), [
    (np.diag((1.0, 1.0, 1.0, 0.0)), "must not be 0"), (np.diag((0.0, 1.0, 1.0, 1.0)), "determinant is 0")
])  # fmt: skip
def test_singular_matrices_are_not_decomposed(matrix: Array, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        decompose_matrix(matrix)


def test_a_pitch_of_a_right_angle_is_decomposed() -> None:
    matrix = compose_matrix(angles=(0.3, math.pi / 2, 0.0))

    assert is_same_transform(matrix, compose_matrix(*decompose_matrix(matrix)))


def test_an_orthogonal_cell_scales_its_axes() -> None:
    assert np.allclose(orthogonalization_matrix((10, 10, 10), (90, 90, 90))[:3, :3], 10 * np.identity(3))


@pytest.mark.parametrize("usesvd", [True, False])
@pytest.mark.parametrize("scaling", [True, False])
def test_two_sets_of_points_are_superimposed(scaling: bool, usesvd: bool) -> None:
    points = np.vstack((DRAW.uniform(-5, 5, (3, 8)), np.ones(8)))
    matrix = concatenate_matrices(
        rotation_matrix(0.9, NORMAL, POINT), scale_matrix(2.0) if scaling else identity_matrix()
    )

    found = superimposition_matrix(points[:3], (matrix @ points)[:3], scaling, usesvd)
    assert np.allclose(found @ points, matrix @ points)
    with pytest.raises(ValueError, match="must"):
        superimposition_matrix(np.ones((3, 2)), np.ones((3, 2)), scaling, usesvd)


def test_dragging_an_arcball_rotates_it() -> None:
    ball = Arcball()
    ball.place((100, 100), 100)
    ball.down((100, 100))
    ball.drag((100 + 100 * math.sin(0.3), 100))

    assert np.allclose(ball.matrix(), rotation_matrix(0.6, (0, 1, 0)))
    ball.next()
    assert np.allclose(ball.matrix(), rotation_matrix(1.2, (0, 1, 0)))
    ball.drag((100, 100))
    assert np.allclose(ball.matrix(), np.identity(4))


def test_a_constrained_arcball_rotates_about_its_axes_only() -> None:
    ball = Arcball()
    ball.place((0, 0), 1)
    ball.setaxes((0, 0, 2), (0, 1, 0))
    ball.setconstrain(True)
    assert ball.getconstrain()
    ball.down((0.5, 0.0))
    ball.drag((0.3, 0.4))

    axis = rotation_from_matrix(ball.matrix())[1]
    assert np.allclose(np.abs(axis), (0, 0, 1)) or np.allclose(np.abs(axis), (0, 1, 0))
    ball.setaxes(None)
    ball.down((0.5, 0.0))
    ball.drag((0.1, 0.9))
    assert np.abs(rotation_from_matrix(ball.matrix())[1][0]) > 0.01


def test_a_point_outside_of_an_arcball_is_projected_to_its_edge() -> None:
    assert np.allclose(arcball_map_to_sphere((300, 100), (100, 100), 100), (1, 0, 0))


@pytest.mark.parametrize("initial", [quaternion_about_axis(0.5, NORMAL) * 2, rotation_matrix(0.5, NORMAL)])
def test_an_arcball_starts_at_a_quaternion_or_a_matrix(initial: Array) -> None:
    assert np.allclose(Arcball(initial).matrix(), rotation_matrix(0.5, NORMAL))


def test_an_arcball_refuses_other_start_values() -> None:
    with pytest.raises(ValueError, match="initial must have shape"):
        Arcball((1, 2, 3))


# tf.transformations: matrices, Euler angles and quaternions.


DRAW_ANGLES = np.random.default_rng(5)


@pytest.mark.parametrize("axes", sorted(tf._AXES2TUPLE))
def test_angles_matrices_and_quaternions_of_each_convention_say_the_same(axes: str) -> None:
    angles = DRAW_ANGLES.uniform(0.1, 1.4, 3)

    matrix = tf.euler_matrix(*angles, axes=axes)
    quaternion = tf.quaternion_from_euler(*angles, axes=axes)

    assert np.allclose(tf.quaternion_matrix(quaternion), matrix)
    for found in (tf.euler_from_matrix(matrix, axes), tf.euler_from_quaternion(quaternion, axes)):
        assert np.allclose(tf.euler_matrix(*found, axes=axes), matrix)
    assert np.allclose(tf.euler_matrix(*angles, axes=tf._AXES2TUPLE[axes]), matrix)


def test_each_function_is_the_one_of_its_name() -> None:
    """Their results are tested in test_matrices.py."""
    place = "pipros_libraries.transforms.matrices."
    found = {
        name: each for name, each in vars(tf).items() if getattr(each, "__module__", "").startswith(place)
    }
    of_matrices = {name: each for name, each in found.items() if name[0] != "_"}
    assert len(of_matrices) > 35
    assert [name for name, each in of_matrices.items() if each.__name__ != name] == []


def test_there_are_24_conventions() -> None:
    assert (len(tf._AXES2TUPLE), tf._AXES2TUPLE["sxyz"]) == (24, (0, 0, 0, 0))
    assert tf._AXES2TUPLE["rzyx"] == (0, 0, 0, 1)
    with pytest.raises(KeyError):
        tf.euler_matrix(1, 2, 3, "xyz")


def test_yaw_is_a_turn_around_z() -> None:
    quaternion = tf.quaternion_from_euler(0, 0, math.pi / 2)

    assert np.allclose(quaternion, (0, 0, math.sqrt(0.5), math.sqrt(0.5)))
    assert np.allclose(tf.quaternion_matrix(quaternion) @ (1, 0, 0, 1), (0, 1, 0, 1))


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

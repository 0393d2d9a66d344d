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
    assert len(tf._AXES2TUPLE) == 24
    assert tf._AXES2TUPLE["sxyz"] == (0, 0, 0, 0)
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

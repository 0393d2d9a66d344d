"""`tf.transformations`: homogeneous 4x4 matrices, Euler angles and quaternions (x, y, z, w), with numpy.

Without numpy, the most common functions of quaternions return tuples, and all others raise ImportError.
"""

import math as math
import warnings as warnings
from typing import Any as _Any

from pipros_libraries.transforms.rotations import without_numpy as _without_numpy

try:
    from pipros_libraries.transforms.matrices import numpy as numpy
    from pipros_libraries.transforms.matrices.affine import reflection_from_matrix as reflection_from_matrix
    from pipros_libraries.transforms.matrices.affine import reflection_matrix as reflection_matrix
    from pipros_libraries.transforms.matrices.affine import rotation_from_matrix as rotation_from_matrix
    from pipros_libraries.transforms.matrices.affine import rotation_matrix as rotation_matrix
    from pipros_libraries.transforms.matrices.affine import scale_from_matrix as scale_from_matrix
    from pipros_libraries.transforms.matrices.affine import scale_matrix as scale_matrix
    from pipros_libraries.transforms.matrices.affine import shear_from_matrix as shear_from_matrix
    from pipros_libraries.transforms.matrices.affine import shear_matrix as shear_matrix
    from pipros_libraries.transforms.matrices.affine import translation_from_matrix as translation_from_matrix
    from pipros_libraries.transforms.matrices.affine import translation_matrix as translation_matrix
    from pipros_libraries.transforms.matrices.arcball import Arcball as _Ball
    from pipros_libraries.transforms.matrices.arcball import (
        arcball_constrain_to_axis as arcball_constrain_to_axis,
    )
    from pipros_libraries.transforms.matrices.arcball import arcball_map_to_sphere as arcball_map_to_sphere
    from pipros_libraries.transforms.matrices.arcball import arcball_nearest_axis as arcball_nearest_axis
    from pipros_libraries.transforms.matrices.arrays import EPSILON as _EPS  # noqa: F401 # scripts read it
    from pipros_libraries.transforms.matrices.arrays import concatenate_matrices as concatenate_matrices
    from pipros_libraries.transforms.matrices.arrays import identity_matrix as identity_matrix
    from pipros_libraries.transforms.matrices.arrays import inverse_matrix as inverse_matrix
    from pipros_libraries.transforms.matrices.arrays import is_same_transform as is_same_transform
    from pipros_libraries.transforms.matrices.arrays import random_vector as random_vector
    from pipros_libraries.transforms.matrices.arrays import unit_vector as unit_vector
    from pipros_libraries.transforms.matrices.arrays import vector_norm as vector_norm
    from pipros_libraries.transforms.matrices.composition import compose_matrix as compose_matrix
    from pipros_libraries.transforms.matrices.composition import decompose_matrix as decompose_matrix
    from pipros_libraries.transforms.matrices.composition import (
        orthogonalization_matrix as orthogonalization_matrix,
    )
    from pipros_libraries.transforms.matrices.composition import (
        superimposition_matrix as superimposition_matrix,
    )
    from pipros_libraries.transforms.matrices.euler import CONVENTIONS as _AXES2TUPLE  # noqa: F401 # scripts read it
    from pipros_libraries.transforms.matrices.euler import NAMES as _TUPLE2AXES  # noqa: F401 # scripts read it
    from pipros_libraries.transforms.matrices.euler import euler_from_matrix as euler_from_matrix
    from pipros_libraries.transforms.matrices.euler import euler_matrix as euler_matrix
    from pipros_libraries.transforms.matrices.projections import clip_matrix as clip_matrix
    from pipros_libraries.transforms.matrices.projections import (
        projection_from_matrix as projection_from_matrix,
    )
    from pipros_libraries.transforms.matrices.projections import projection_matrix as projection_matrix
    from pipros_libraries.transforms.matrices.quaternions import (
        euler_from_quaternion as euler_from_quaternion,
    )
    from pipros_libraries.transforms.matrices.quaternions import (
        quaternion_about_axis as quaternion_about_axis,
    )
    from pipros_libraries.transforms.matrices.quaternions import quaternion_conjugate as quaternion_conjugate
    from pipros_libraries.transforms.matrices.quaternions import (
        quaternion_from_euler as quaternion_from_euler,
    )
    from pipros_libraries.transforms.matrices.quaternions import (
        quaternion_from_matrix as quaternion_from_matrix,
    )
    from pipros_libraries.transforms.matrices.quaternions import quaternion_inverse as quaternion_inverse
    from pipros_libraries.transforms.matrices.quaternions import quaternion_matrix as quaternion_matrix
    from pipros_libraries.transforms.matrices.quaternions import quaternion_multiply as quaternion_multiply
    from pipros_libraries.transforms.matrices.quaternions import quaternion_slerp as quaternion_slerp
    from pipros_libraries.transforms.matrices.quaternions import random_quaternion as random_quaternion
    from pipros_libraries.transforms.matrices.quaternions import (
        random_rotation_matrix as random_rotation_matrix,
    )

    class Arcball(_Ball):
        """Arcball with Noetic's method names."""

        def setaxes(self, *axes: _Any) -> None:
            """Set the axes for constrained rotations; None removes them."""
            self.axes = None if axes and axes[0] is None else [unit_vector(axis) for axis in axes]

        def setconstrain(self, constrain: bool) -> None:
            """Set whether rotations are constrained to the axes set with `setaxes`."""
            self.is_constrained = constrain is True

        def getconstrain(self) -> bool:
            """Return whether rotations are constrained to the axes set with `setaxes`."""
            return self.is_constrained
except ImportError as _error:
    _without_numpy(__name__, _error)

_NEXT_AXIS = [1, 2, 0, 1]

"""Homogeneous 4x4 matrices, Euler angles and quaternions with numpy: the functions of `tf.transformations`.

Matrices act on column vectors. Unless stated otherwise, matrices have the shape (4, 4), quaternions (qx, qy,
qz, qw) the shape (4,), and vectors the shape (3,). Angles are in radians.

The buffer uses `transforms.pose` instead, which does not need numpy and rounds like tf2;
`tests/unit/transforms/test_pose_and_matrices.py` compares the two.
"""

from pipros.basics.extras import missing

try:
    import numpy as numpy  # the import error is raised here for all modules in the package
except ImportError as error:
    raise missing("tf.transformations needs numpy", "numpy", error) from error

"""Homogeneous 4x4 matrices, Euler angles and quaternions on numpy: what `tf.transformations` offers.

Matrices act on column vectors. Quaternions are (x, y, z, w). Angles are radians unless a function says
otherwise.
"""

try:
    import numpy as numpy  # looked for here, once for all modules of the package
except ImportError as error:
    raise ImportError(
        "tf.transformations needs numpy, which is not installed. Try: pip install 'pipros[numpy]'",
        name=error.name,
    ) from error

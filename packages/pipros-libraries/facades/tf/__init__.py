"""Drop-in replacement for Noetic's tf.

`tf.transformations` requires numpy (`pip install 'pipros[numpy]'`) and is imported on first use.
"""

import typing as _typing

import pipros.startup as _startup  # noqa: F401 # installs the import hook, in case pipros.pth did not
from pipros.basics.lazy_names import lazy_names as _lazy_names
from pipros.basics.lazy_names import star_names as _star_names
from tf.broadcaster import TransformBroadcaster as TransformBroadcaster
from tf.listener import Transformer as Transformer
from tf.listener import TransformerROS as TransformerROS
from tf.listener import TransformListener as TransformListener
from tf2_ros import ConnectivityException as ConnectivityException
from tf2_ros import ExtrapolationException as ExtrapolationException
from tf2_ros import LookupException as LookupException
from tf2_ros import TransformException as _TransformException

Exception = _TransformException  # noqa: A001 # its name in tf

if _typing.TYPE_CHECKING:
    from tf import transformations as transformations
else:
    __getattr__, __dir__ = _lazy_names(__name__, {}, submodules=("transformations",))

_star_names(__name__, "tf.transformations", hidden="transformer")

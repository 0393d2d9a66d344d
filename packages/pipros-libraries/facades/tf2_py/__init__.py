"""Drop-in replacement for Noetic's tf2_py: a transform buffer without topics."""

from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.transforms.errors import ConnectivityException as ConnectivityException
from pipros_libraries.transforms.errors import ExtrapolationException as ExtrapolationException
from pipros_libraries.transforms.errors import InvalidArgumentException as InvalidArgumentException
from pipros_libraries.transforms.errors import LookupException as LookupException
from pipros_libraries.transforms.errors import TimeoutException as TimeoutException
from pipros_libraries.transforms.errors import TransformException as TransformException
from tf2_py.buffer_core import BufferCore as BufferCore

_star_names(__name__, hidden="buffer_core")

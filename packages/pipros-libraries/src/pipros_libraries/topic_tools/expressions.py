"""The modules that `transform` expressions may import, restricted to harmless names.

Expressions can access only the numpy names listed here, which exclude functions that read files or create
arrays of arbitrary size.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import FunctionType, ModuleType
from typing import Any

from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.extras import install_command
from pipros.msg import load_message_class
from pipros.msg.time import Duration, Time

_NUMPY = """
abs absolute add all allclose amax amin angle any append arccos arccosh arcsin arcsinh arctan arctan2
arctanh argmax argmin argsort around array asarray average bool_ cbrt ceil clip concatenate conj copysign
cos cosh count_nonzero cross cumprod cumsum deg2rad degrees diff divide dot e exp exp2 expm1 fabs flip
float32 float64 floor fmax fmin fmod greater hypot imag inf int16 int32 int64 int8 isclose isfinite isinf
isnan isreal less linalg log log10 log1p log2 logical_and logical_not logical_or matmul max maximum mean
median min minimum mod multiply nan nan_to_num nanmax nanmean nanmedian nanmin nanstd nansum nanvar
negative newaxis norm percentile pi power prod ptp quantile rad2deg radians real reciprocal remainder
rint roll round round_ sign sin sinc sinh size sort sqrt square squeeze std subtract sum tan tanh trapz
transpose trunc uint16 uint32 uint64 uint8 unique unwrap var vdot where
"""
NUMPY = frozenset(_NUMPY.split())
_LINALG = """
cond det eig eigh eigvals eigvalsh inv lstsq matrix_rank norm pinv qr solve svd
"""
LINALG = frozenset(_LINALG.split())
_ARRAY = """
T all any argmax argmin argsort clip cumprod cumsum dot flatten imag item max mean min ndim prod ptp
ravel real reshape round shape size squeeze std sum tolist trace transpose var
"""
ARRAY = frozenset(_ARRAY.split())

_MESSAGES = ("_msgs", "_tutorials")


@dataclass(frozen=True, slots=True)
class ModuleNames:
    """The names in a module that expressions may use.

    Attributes:
        title: the module name to use in error messages.
        names: permitted values by name.
    """

    title: str
    names: Mapping[str, Any] = field(default_factory=dict)

    def find(self, name: str) -> Any:
        """Return the value of a name. Raises AttributeError if it is not permitted."""
        try:
            return self.names[name]
        except KeyError:
            raise AttributeError(f"{self.title}.{name} does not exist in expressions") from None


class MessagePackage(ModuleNames):
    """A message package, used in expressions such as `geometry_msgs.msg.Point(1, 2, 3)`."""

    __slots__ = ()

    def find(self, name: str) -> Any:
        if name == "msg":
            return MessageModule(f"{self.title}.msg")
        raise AttributeError(f"{self.title}.{name} does not exist in expressions; only {self.title}.msg does")


class MessageModule(ModuleNames):
    """The module `msg` of a message package."""

    __slots__ = ()

    def find(self, name: str) -> Callable[..., Any]:
        package = self.title.removesuffix(".msg")
        try:
            return load_message_class(f"{package}/{name}")
        except PiprosError as error:
            raise AttributeError(str(error)) from None


def module_for(module: str, now: Callable[[], Time]) -> ModuleNames:
    """Return the names in a module that expressions may use.

    Args:
        module: `numpy`, `math`, `rospy`, `tf`, or a message package.
        now: function that returns the current time, for `rospy.Time.now()`.

    Raises:
        NotFound: the module is not installed, or expressions cannot import it.
    """
    top = module.partition(".")[0]
    if top == "numpy":
        return _numpy()
    if top == "math":
        return ModuleNames(
            "math", {name: value for name, value in vars(math).items() if not name.startswith("_")}
        )
    if top == "rospy":
        return ModuleNames(
            "rospy",
            {"Time": ModuleNames("rospy.Time", {"now": now}), "Duration": Duration, "get_rostime": now},
        )
    if top == "tf":
        return ModuleNames("tf", {"transformations": _transformations()})
    if top.endswith(_MESSAGES):
        return MessagePackage(top)
    raise NotFound(
        f"an expression cannot import {module}; it can import numpy, math, "
        "rospy (only Time.now, Duration and get_rostime), tf (only transformations), "
        "and packages whose names end in _msgs or _tutorials"
    )


def _numpy() -> ModuleNames:
    try:
        numpy = importlib.import_module("numpy")
    except ImportError:
        raise NotFound(f"numpy is not installed; try: {install_command('numpy')}") from None
    linalg = ModuleNames("numpy.linalg", _listed(numpy.linalg, LINALG))
    return ModuleNames("numpy", {**_listed(numpy, NUMPY - {"linalg"}), "linalg": linalg})


def _transformations() -> ModuleNames:
    try:
        from pipros.libraries.transforms.matrices import affine, arrays, composition, euler, quaternions
    except ImportError as error:
        raise NotFound(str(error)) from None
    found = {}
    for module in (affine, arrays, composition, euler, quaternions):
        found.update({name: value for name, value in vars(module).items() if _is_function_of(module, name)})
    return ModuleNames("tf.transformations", found)


def _is_function_of(module: ModuleType, name: str) -> bool:
    value = getattr(module, name)
    return (
        not name.startswith("_") and isinstance(value, FunctionType) and value.__module__ == module.__name__
    )


def _listed(module: Any, names: frozenset[str] | set[str]) -> dict[str, Any]:
    return {name: getattr(module, name) for name in names if hasattr(module, name)}

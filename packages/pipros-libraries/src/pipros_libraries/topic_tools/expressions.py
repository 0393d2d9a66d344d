"""Expressions for `transform` and `relay_field`. They are evaluated without running Python code.

Expressions can import only harmless modules, and access only the numpy names listed here, which exclude
functions that read files or create arrays of arbitrary size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import FunctionType, ModuleType
from typing import Any

from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.extras import install_command, optional
from pipros.msg import load_message_class
from pipros.msg.field_access import field_of
from pipros.msg.time import Duration, Time
from pipros.safe.expr import Expression
from pipros.safe.expr_walk import ExpressionError
from pipros.safe.guarded import CONSTANTS, FUNCTIONS
from pipros.safe.yaml import load


class NotAMapping(PiprosError, ValueError):
    """The template of `relay_field` is not a mapping."""


def part_of(value: Any, name: str) -> Any:
    """Return a field of a message, a permitted attribute of an array, or a member of a module.

    Raises:
        AttributeError: the name does not exist or is not permitted.
    """
    if isinstance(value, ModuleNames):
        return value.find(name)
    if type(value).__module__ == "numpy":
        if name not in ARRAY:
            raise AttributeError(f"expressions cannot use the array attribute .{name}")
        return getattr(value, name)
    return field_of(value, name)


class Transformation:
    """An expression for `transform` that computes an output message's fields from the input message `m`.

    >>> Transformation("(m * 2, 'x')", [], Time).arguments(4)
    (8, 'x')
    >>> Transformation("math.sqrt(m)", ["math"], Time).arguments(4)
    [2.0]
    """

    def __init__(self, text: str, modules: Sequence[str], now: Callable[[], Time]) -> None:
        """Parse the expression.

        Args:
            text: the expression.
            modules: modules to import.
            now: function that returns the current time.

        Raises:
            ExpressionError: the expression is malformed, or uses a module that cannot be imported.
        """
        self.missing: dict[str, str] = {}
        """Unused modules that cannot be imported, with the reasons."""
        self._names: dict[str, Any] = {}
        for module in modules:
            try:
                self._names[module.partition(".")[0]] = module_for(module, now)
            except PiprosError as error:
                self.missing[module] = str(error)
        self._expression = Expression(text, fields=part_of)
        used = self._expression.names()
        for module, reason in self.missing.items():
            if module.partition(".")[0] in used:
                raise ExpressionError(text, 0, reason)

    def arguments(self, message: Any) -> Sequence[Any]:
        """Return the arguments for `publish`. Raises `ExpressionError` if the evaluation fails."""
        value = self._expression.value({**self._names, "m": message})
        return value if isinstance(value, (list, tuple)) else [value]


class Template:
    """Field values for `relay_field`, as YAML in which strings may be expressions that use the message `m`.

    A string is an expression if `m` and known functions are the only names in it. Other strings, and strings
    in lists, are literals. For example, `m.data`, `m.x * 2` and `len(m.data)` are evaluated, but `base_link`
    and `map` are not.

    >>> Template("{frame_id: map, seq: m + 1, stamp: {secs: 3}}").fields(4)
    {'frame_id': 'map', 'seq': 5, 'stamp': {'secs': 3}}
    """

    def __init__(self, text: str) -> None:
        """Parse the template.

        Raises:
            NotAMapping: the text is YAML, but not a mapping.
            pipros.safe.yaml.YamlError: the text is not valid YAML.
        """
        tree = load(text)
        if not isinstance(tree, dict):
            raise NotAMapping(f"the fields must be a YAML mapping such as 'data: m.x', got {tree!r}")
        self._tree = _with_expressions(tree)

    def fields(self, message: Any) -> dict[str, Any]:
        """Return the fields with their values. Raises `ExpressionError` if an expression fails."""
        return _evaluated(self._tree, {"m": message})


def _with_expressions(tree: Mapping[Any, Any]) -> dict[Any, Any]:
    return {key: _prepared(value) for key, value in tree.items()}


def _prepared(value: Any) -> Any:
    if isinstance(value, dict):
        return _with_expressions(value)
    if not isinstance(value, str) or (value.isidentifier() and value != "m"):
        return value
    try:
        expression = Expression(value, fields=part_of)
    except ExpressionError:
        return value
    names = expression.names() - {"m"}
    return expression if names <= FUNCTIONS.keys() - CONSTANTS.keys() else value


def _evaluated(tree: Mapping[Any, Any], names: Mapping[str, Any]) -> dict[Any, Any]:
    filled = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            value = _evaluated(value, names)
        elif isinstance(value, Expression):
            value = value.value(names)
        filled[key] = value
    return filled


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
    numpy = optional("numpy")
    if numpy is None:
        raise NotFound(f"numpy is not installed; try: {install_command('numpy')}")
    linalg = ModuleNames("numpy.linalg", _listed(numpy.linalg, LINALG))
    return ModuleNames("numpy", {**_listed(numpy, NUMPY - {"linalg"}), "linalg": linalg})


def _transformations() -> ModuleNames:
    try:
        from pipros_libraries.transforms.matrices import affine, arrays, composition, euler, quaternions
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

"""`roslib.stacks`, for legacy scripts: search for stacks (groups of packages before catkin) with rospkg."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rospkg import STACK_FILE as STACK_FILE
from rospkg import ResourceNotFound, RosPack, RosStack

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "os re roslib rospkg")

ROS_ROOT = "ROS_ROOT"
ROS_PACKAGE_PATH = "ROS_PACKAGE_PATH"
ROS_STACK = "ros"


class ROSStackException(Exception):
    """Base class of errors about stacks."""


class InvalidROSStackException(ROSStackException):
    """A stack does not exist."""


def list_stacks(env: object = None) -> list[str]:
    """Return the names of all stacks."""
    del env
    return sorted(RosStack().list())


def get_stack_dir(stack: str, env: object = None) -> str:
    """Return the folder of a stack.

    Raises:
        InvalidROSStackException: the stack does not exist.
    """
    del env
    try:
        return str(RosStack().get_path(stack))
    except ResourceNotFound:
        raise InvalidROSStackException(stack) from None


def stack_of(pkg: str, env: object = None) -> str | None:
    """Return the stack that a package belongs to; None for catkin packages.

    Raises:
        rospkg.ResourceNotFound: the package does not exist.
    """
    del env
    stack: str | None = RosPack().stack_of(pkg)
    return stack


def get_stack_version(stack: str, env: object = None) -> str | None:
    """Return the version of a stack.

    Raises:
        rospkg.ResourceNotFound: the stack does not exist.
    """
    del env
    version: str | None = RosStack().get_stack_version(stack)
    return version


def get_stack_version_by_dir(stack_dir: str) -> str | None:
    """Return the version in the `stack.xml` of a folder; None if there is none."""
    from pipros.workspace.dry_manifest import DryManifest, read_into

    file = Path(stack_dir, STACK_FILE)
    if not file.is_file():
        return None
    return read_into(DryManifest("stack"), file.read_text("utf-8"), str(file)).version


def list_stacks_by_path(
    path: str, stacks: list[str] | None = None, cache: dict[str, str] | None = None
) -> list[str]:
    """Return the stacks below a folder; append them to `stacks`, and add their folders to `cache`."""
    found = stacks if stacks is not None else []
    for file in sorted(Path(path).rglob(STACK_FILE)):
        if file.parent.name not in found:
            found.append(file.parent.name)
            if cache is not None:
                cache[file.parent.name] = str(file.parent)
    return found


def expand_to_packages(names: Iterable[str], env: object = None) -> tuple[list[str], list[str]]:
    """Return the packages denoted by names of packages and stacks, and the unknown names."""
    del env
    packs, stacks = RosPack(), RosStack()
    packages, stack_names = set(packs.list()), set(stacks.list())
    found: list[str] = []
    unknown: list[str] = []
    for name in names:
        if name in packages:
            found.append(name)
        elif name in stack_names:
            found += stacks.packages_of(name)
        else:
            unknown.append(name)
    return found, unknown

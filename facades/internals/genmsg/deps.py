"""`genmsg.deps`: the definition files of the types that a message or service embeds."""

from __future__ import annotations

from pathlib import Path

from genmsg.msg_loader import (
    MsgContext,
    SearchPath,
    load_depends,
    load_msg_from_file,
    load_srv_from_file,
)
from genmsg.msgs import MsgSpec
from genmsg.srvs import SrvSpec
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "genmsg os")

Dependency = tuple[str, str | None]


def find_msg_dependencies_with_type(
    pkg_name: str, msg_file: str, search_paths: SearchPath
) -> list[Dependency]:
    """Return `(type, file)` for each type that a message embeds, directly or indirectly.

    Raises:
        genmsg.MsgNotFound: a type is not on the search path.
        genmsg.InvalidMsgSpec: a definition is invalid.
    """
    context = MsgContext.create_default()
    spec = load_msg_from_file(context, msg_file, f"{pkg_name}/{Path(msg_file).stem}")
    return _dependencies(context, spec, [spec.full_name], search_paths)


def find_msg_dependencies(pkg_name: str, msg_file: str, search_paths: SearchPath) -> list[str | None]:
    """Like `find_msg_dependencies_with_type`, but return only the files."""
    return [file for _, file in find_msg_dependencies_with_type(pkg_name, msg_file, search_paths)]


def find_srv_dependencies_with_type(
    pkg_name: str, msg_file: str, search_paths: SearchPath
) -> list[Dependency]:
    """Return `(type, file)` for each type that a service embeds; see `find_msg_dependencies_with_type`."""
    context = MsgContext.create_default()
    spec = load_srv_from_file(context, msg_file, f"{pkg_name}/{Path(msg_file).stem}")
    halves = [spec.request.full_name, spec.response.full_name]
    return _dependencies(context, spec, halves, search_paths)


def find_srv_dependencies(pkg_name: str, msg_file: str, search_paths: SearchPath) -> list[str | None]:
    """Like `find_srv_dependencies_with_type`, but return only the files."""
    return [file for _, file in find_srv_dependencies_with_type(pkg_name, msg_file, search_paths)]


def _dependencies(
    context: MsgContext, spec: MsgSpec | SrvSpec, names: list[str], search_paths: SearchPath
) -> list[Dependency]:
    load_depends(context, spec, search_paths)
    found = dict.fromkeys(name for half in names for name in context.get_all_depends(half))
    return [(name, context.get_file(name)) for name in found]

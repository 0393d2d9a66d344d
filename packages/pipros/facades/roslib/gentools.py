"""`roslib.gentools`, for legacy scripts: dependencies and MD5 sums of definitions, by `genmsg`."""

from __future__ import annotations

import sys
from typing import Any

import rospkg

import genmsg.gentools
from genmsg.msg_loader import MsgContext, load_msg_from_file
from genmsg.msgs import MsgSpec, bare_msg_type, is_builtin
from genmsg.srvs import SrvSpec
from roslib.msgs import MsgSpecException as MsgSpecException
from roslib.packages import resource_file
from roslib.srvs import load_from_file

_context = MsgContext.create_default()
"""All definitions that were read in this process."""


def get_dependencies(
    spec: Any,
    package: str,
    compute_files: bool = True,
    stdout: Any = sys.stdout,  # noqa: ARG001
    stderr: Any = sys.stderr,  # noqa: ARG001
    rospack: Any = None,  # noqa: ARG001
) -> dict[str, Any]:
    """Return the types that a definition embeds, directly or indirectly, as the other functions expect.

    Returns:
        `spec`, `package`, `deps` and `uniquedeps` (types in the order of their use) and, if `compute_files`
        is true, `files` (their definitions).
    """
    halves = (spec.request, spec.response) if isinstance(spec, SrvSpec) else (spec,)
    deps = [name for half in halves for name in _embedded(half, set())]
    found = {"spec": spec, "package": package, "deps": deps, "uniquedeps": list(dict.fromkeys(deps))}
    if compute_files:
        found["files"] = {name: _context.get_file(name) for name in found["uniquedeps"]}
    return found


def _embedded(spec: MsgSpec, within: set[str]) -> list[str]:
    names: list[str] = []
    for name in map(bare_msg_type, spec.types):
        if is_builtin(name) or name in within:
            continue
        if not _context.is_registered(name):
            package, _, base = name.partition("/")
            load_msg_from_file(_context, resource_file(package, "msg", f"{base}.msg"), name)
        names += [name, *_embedded(_context.get_registered(name), within | {name})]
    return names


def get_file_dependencies(
    f: str, stdout: Any = sys.stdout, stderr: Any = sys.stderr, rospack: Any = None
) -> dict[str, Any]:
    """Return the types that the definition in a file embeds; see `get_dependencies`.

    Raises:
        Exception: the file is neither a .msg nor a .srv file.
    """
    package = rospkg.get_package_name(f)
    if f.endswith(".msg"):
        name = f.rpartition("/")[2].removesuffix(".msg")
        spec: Any = load_msg_from_file(_context, f, f"{package}/{name}")
    elif f.endswith(".srv"):
        _, spec = load_from_file(f, package)
    else:
        raise Exception(f"[{f}] does not appear to be a message or service")
    return get_dependencies(spec, package, stdout=stdout, stderr=stderr, rospack=rospack)


def compute_md5(get_deps_dict: dict[str, Any], rospack: Any = None) -> str:  # noqa: ARG001
    """Return the MD5 sum of a definition, given the result of `get_dependencies`."""
    return genmsg.gentools.compute_md5(_context, get_deps_dict["spec"])


compute_md5_v2 = compute_md5


def compute_md5_text(get_deps_dict: dict[str, Any], spec: MsgSpec, rospack: Any = None) -> str:  # noqa: ARG001
    """Return the text from which the MD5 sum of a message is computed."""
    return genmsg.gentools.compute_md5_text(_context, spec)


def compute_full_text(get_deps_dict: dict[str, Any]) -> str:
    """Return a definition, followed by the definitions of all embedded types."""
    texts = [get_deps_dict["spec"].text]
    for name in get_deps_dict["uniquedeps"]:
        texts += ["=" * 80, f"MSG: {name}", _context.get_registered(name).text]
    return "\n".join(texts)

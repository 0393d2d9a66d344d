"""`roslib.gentools`, for legacy scripts: dependencies, MD5 sums and full texts; see `genmsg`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NoReturn, TypedDict

from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg.importing.hook import installed_library
from pipros.msg.language import digest
from pipros.msg.language.spec import MessageSpec
from roslib import msgs, srvs
from roslib.msgs import MsgSpec
from roslib.msgs import MsgSpecException as MsgSpecException
from roslib.packages import get_dir_pkg
from roslib.srvs import SrvSpec

_star_names(__name__, "roslib rospkg io:StringIO sys")


class Dependencies(TypedDict):
    """Dependencies of a definition.

    Attributes:
        files: the file of each directly or indirectly embedded type.
        deps: these types, with repetitions; `uniquedeps` lists each type once.
    """

    files: dict[str, str]
    deps: list[str]
    uniquedeps: list[str]
    spec: MsgSpec | SrvSpec
    package: str


def get_dependencies(
    spec: MsgSpec | SrvSpec,
    package: str,
    compute_files: bool = True,
    stdout: Any = None,
    stderr: Any = None,
    rospack: Any = None,
) -> Dependencies:
    """Return the types that a definition in the package embeds, directly or indirectly.

    Raises:
        MsgSpecException: a type cannot be found.
    """
    del stdout, stderr, rospack
    deps: list[str] = []
    halves = [spec.request, spec.response] if isinstance(spec, SrvSpec) else [spec]
    for half in halves:
        _add_depends(half, package, deps)
    unique = list(dict.fromkeys(deps))
    files = {name: msgs.msg_file(*name.split("/")) for name in unique} if compute_files else {}
    return {"files": files, "deps": deps, "uniquedeps": unique, "spec": spec, "package": package}


def _add_depends(spec: MsgSpec, package: str, deps: list[str]) -> None:
    for kind in spec.types:
        bare = msgs.base_msg_type(kind)
        if msgs.is_builtin(bare):
            continue
        name = msgs.resolve_type(bare, package)
        deps.append(name)
        if deps.count(name) == 1:
            _add_depends(_embedded(name), name.partition("/")[0], deps)


def _embedded(name: str) -> MsgSpec:
    if msgs.is_registered(name):
        return msgs.get_registered(name)
    try:
        return msgs.load_by_type(name)[1]
    except (OSError, MsgSpecException):
        raise MsgSpecException(
            f"Cannot load type '{name}'.  Perhaps the package is missing a dependency."
        ) from None


def get_file_dependencies(
    f: str, stdout: Any = None, stderr: Any = None, rospack: Any = None
) -> Dependencies:
    """Return the types that the definition in a file embeds; see `get_dependencies`.

    Raises:
        OSError: the file cannot be read.
        MsgSpecException: the definition is invalid, or a type cannot be found.
        Exception: the file is neither a `.msg` nor a `.srv` file.
    """
    _, package = get_dir_pkg(str(Path(f).parent))
    spec: MsgSpec | SrvSpec
    if f.endswith(msgs.EXT):
        _, spec = msgs.load_from_file(f, package or "")
    elif f.endswith(srvs.EXT):
        _, spec = srvs.load_from_file(f, package or "")
    else:
        raise Exception(
            f"[{f}] does not appear to be a message or service"
        )  # users of roslib catch this class
    return get_dependencies(spec, package or "", stdout=stdout, stderr=stderr, rospack=rospack)


def compute_md5_text(get_deps_dict: Dependencies, spec: MsgSpec, rospack: Any = None) -> str:
    """Return the text from which a message's MD5 sum is computed."""
    del rospack
    return digest.md5_text(_definition(spec, get_deps_dict["package"]), _lookup)


def compute_md5(get_deps_dict: Dependencies, rospack: Any = None) -> str:
    """Return the MD5 sum of a definition, given the result of `get_file_dependencies`."""
    del rospack
    spec = get_deps_dict["spec"]
    if isinstance(spec, SrvSpec):
        package = get_deps_dict["package"]
        halves = (
            digest.complete(_definition(half, package), _lookup) for half in (spec.request, spec.response)
        )
        return digest.md5_of_halves(*halves)
    return digest.message_md5(_definition(spec, get_deps_dict["package"]), _lookup)


compute_md5_v2 = compute_md5


def compute_md5_v1(get_deps_dict: Dependencies) -> NoReturn:
    """Compute the MD5 sum by the rules used before 2009. As in Noetic, this does not work.

    Raises:
        NotImplementedError: always.
    """
    raise NotImplementedError(
        f"the MD5 sum used before 2009 is not supported ({get_deps_dict['package']}): use compute_md5"
    )


def compute_full_text(get_deps_dict: Dependencies) -> str:
    """Return the definition, followed by the definitions of all embedded types."""
    spec = get_deps_dict["spec"]
    parts = [spec.text, *(f"MSG: {name}\n{_embedded(name).text}" for name in get_deps_dict["uniquedeps"])]
    return f"\n{'=' * 80}\n".join(parts)


def _definition(spec: MsgSpec, package: str) -> MessageSpec:
    """Parse a definition again from its parts, because it may have been created without text or a name."""
    constants = [f"{c.type} {c.name}={c.val_text}" for c in spec.constants]
    fields = [f"{kind} {name}" for kind, name in zip(spec.types, spec.names, strict=True)]
    return msgs.read("\n".join([*constants, *fields]), spec.full_name or f"{package}/Text")


def _lookup(type_name: str) -> MessageSpec:
    if msgs.is_registered(type_name):
        return _definition(msgs.get_registered(type_name), type_name.partition("/")[0])
    return installed_library().definitions.message(type_name)

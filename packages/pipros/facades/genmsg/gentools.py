"""`genmsg.gentools`: MD5 sums and full texts of loaded definitions."""

from __future__ import annotations

from genmsg.base import InvalidMsgSpec, MsgGenerationException
from genmsg.msg_loader import MsgContext, load_depends
from genmsg.msgs import MsgSpec, bare_msg_type, is_builtin
from genmsg.srvs import SrvSpec
from pipros.msg.language import digest
from pipros.msg.language.spec import MessageSpec, ServiceSpec

__all__ = [
    "InvalidMsgSpec",
    "MsgSpec",
    "SrvSpec",
    "bare_msg_type",
    "compute_full_text",
    "compute_full_type_name",
    "compute_md5",
    "compute_md5_text",
    "compute_md5_v2",
    "is_builtin",
    "load_depends",
]


def compute_md5_text(msg_context: MsgContext, spec: MsgSpec) -> str:
    """Return the text from which the MD5 sum is computed. Types embedded by `spec` must be loaded."""
    return digest.md5_text(spec.definition(), _lookup(msg_context))


def compute_md5(msg_context: MsgContext, spec: MsgSpec | SrvSpec) -> str:
    """Return the MD5 sum of a message or service. The embedded types must be loaded."""
    if isinstance(spec, SrvSpec):
        return digest.service_md5(_service(spec), _lookup(msg_context))
    return digest.message_md5(spec.definition(), _lookup(msg_context))


compute_md5_v2 = compute_md5


def compute_full_text(msg_context: MsgContext, spec: MsgSpec) -> str:
    """Return the definition, followed by the definitions of all embedded types, which must be loaded.

    Raises:
        KeyError: the definition is not registered, or is a service, which does not have a full text.
    """
    if not msg_context.is_registered(spec.full_name):
        raise KeyError(spec.full_name)
    return digest.full_text(spec.definition(), _lookup(msg_context))


def compute_full_type_name(package_name: str, file_name: str) -> str:
    """Return `package/Name` for a file Name.msg or Name.srv.

    Raises:
        MsgGenerationException: the file has another extension.
    """
    for extension in (".msg", ".srv"):
        if file_name.endswith(extension):
            return f"{package_name}/{file_name.removesuffix(extension)}"
    raise MsgGenerationException(f"Processing file: '{file_name}' - unknown file extension")


def _service(spec: SrvSpec) -> ServiceSpec:
    return ServiceSpec(spec.full_name, spec.request.definition(), spec.response.definition(), spec.text)


def _lookup(msg_context: MsgContext) -> digest.Lookup:
    def lookup(type_name: str) -> MessageSpec:
        return msg_context.get_registered(type_name).definition()

    return lookup

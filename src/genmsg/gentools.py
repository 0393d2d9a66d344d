"""`genmsg.gentools`: md5 and full text of loaded definitions."""

from __future__ import annotations

from genmsg.msg_loader import MsgContext
from genmsg.msgs import MsgSpec
from genmsg.srvs import SrvSpec
from pipros.msg.language import digest
from pipros.msg.language.spec import MessageSpec, ServiceSpec

__all__ = ["compute_full_text", "compute_full_type_name", "compute_md5", "compute_md5_text"]


def compute_md5_text(msg_context: MsgContext, spec: MsgSpec) -> str:
    """The text over which the md5 is computed. The types that `spec` embeds must be loaded."""
    return digest.md5_text(spec.definition(), _lookup(msg_context))


def compute_md5(msg_context: MsgContext, spec: MsgSpec | SrvSpec) -> str:
    """The md5 of a message or a service. The types that it embeds must be loaded."""
    if isinstance(spec, SrvSpec):
        service = ServiceSpec(
            spec.full_name, spec.request.definition(), spec.response.definition(), spec.text, spec.full_name
        )
        return digest.service_md5(service, _lookup(msg_context))
    return digest.message_md5(spec.definition(), _lookup(msg_context))


def compute_full_text(msg_context: MsgContext, spec: MsgSpec) -> str:
    """The definition followed by those of all types it embeds. These must be loaded."""
    return digest.full_text(spec.definition(), _lookup(msg_context))


def compute_full_type_name(package_name: str, file_name: str) -> str:
    """`package/Name` for a file Name.msg or Name.srv.

    Raises:
        ValueError: for another file.
    """
    for extension in (".msg", ".srv"):
        if file_name.endswith(extension):
            return f"{package_name}/{file_name.removesuffix(extension)}"
    raise ValueError(f"file name {file_name} does not end with .msg or .srv")


def _lookup(msg_context: MsgContext) -> digest.Lookup:
    def lookup(type_name: str) -> MessageSpec:
        return msg_context.get_registered(type_name).definition()

    return lookup

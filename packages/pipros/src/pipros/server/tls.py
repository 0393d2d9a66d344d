"""TLS settings of a server, the fingerprint of its certificate, and the exception for failed starts."""

from __future__ import annotations

import hashlib
import ssl
from pathlib import Path

from pipros.basics.errors import PiprosError

EVERYWHERE = ("0.0.0.0", "::")  # noqa: S104 - only if --bind requests it


class ServerFailed(PiprosError):
    """The server cannot be started."""


def tls_context(certificate: str | None, key: str | None) -> ssl.SSLContext | None:
    """Return the settings of a TLS server, or None if there is no certificate.

    Raises:
        ServerFailed: the certificate or its key cannot be read.
    """
    if certificate is None:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(certificate, key)
    except (OSError, ssl.SSLError) as error:
        raise ServerFailed(f"cannot use the certificate {certificate}: {error}") from None
    return context


def fingerprint_of(certificate: str) -> str:
    """Return the SHA-256 of a PEM file's first certificate, as browsers show it, or "" if there is none."""
    text = Path(certificate).read_text(encoding="ascii", errors="replace")
    begin, end = text.find(ssl.PEM_HEADER), text.find(ssl.PEM_FOOTER)
    if not 0 <= begin < end:
        return ""
    der = ssl.PEM_cert_to_DER_cert(text[begin : end + len(ssl.PEM_FOOTER)])
    return hashlib.sha256(der).digest().hex(":").upper()

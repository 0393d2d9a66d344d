"""TLS settings of a server, the fingerprint of its certificate, and the exception for failed starts."""

from __future__ import annotations

import hashlib
import ssl

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file, read_text

EVERYWHERE = ("0.0.0.0", "::")  # noqa: S104 - only if --bind requests it


class ServerFailed(PiprosError):
    """The server cannot be started."""


def tls_context(certificate: str | None, key: str | None) -> ssl.SSLContext | None:
    """Return the settings of a TLS server, or None if there is neither a certificate nor a key.

    Raises:
        ServerFailed: the certificate or its key cannot be read, or the key has a passphrase, for which a
            server cannot ask; or there is a key, but no certificate.
    """
    if certificate is None:
        if key is not None:
            raise ServerFailed(f"the key {key} needs its certificate; give it with --cert")
        return None

    def refuse() -> bytes:
        advice = "openssl pkey -in KEY -out NEW writes it without one"
        raise ServerFailed(f"cannot use the key {key or certificate}: it has a passphrase. Try: {advice}")

    _check("certificate", certificate)
    if key is not None:
        _check("key", key)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(certificate, key, refuse)
    except OSError as error:
        pair = f"{certificate} with the key {key}" if key else certificate
        raise ServerFailed(f"cannot use the certificate {pair}: {_reason(error)}") from None
    return context


def _check(what: str, file: str) -> None:
    """Raise `ServerFailed` if a file cannot be read; `load_cert_chain` does not tell which one."""
    try:
        open_file(file).close()
    except OSError as error:
        raise ServerFailed(f"cannot use the {what} {file}: {error.strerror or error}") from None


def _reason(error: OSError) -> str:
    if getattr(error, "reason", None) in ("KEY_VALUES_MISMATCH", "NO_CERTIFICATE_ASSIGNED"):
        return "the key belongs to another certificate"
    if "PEM lib" in str(error):
        return "a certificate and its private key, both in PEM format, are needed"
    return str(error)


def fingerprint_of(certificate: str) -> str:
    """Return the SHA-256 of a PEM file's first certificate, as browsers show it, or "" if there is none."""
    text = read_text(certificate, errors="replace")
    begin, end = text.find(ssl.PEM_HEADER), text.find(ssl.PEM_FOOTER)
    if not 0 <= begin < end:
        return ""
    der = ssl.PEM_cert_to_DER_cert(text[begin : end + len(ssl.PEM_FOOTER)])
    return hashlib.sha256(der).digest().hex(":").upper()

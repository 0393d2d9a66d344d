"""Certificates and keys that a server cannot use."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from pipros_server.tls import ServerFailed, tls_context
from tests.support.environments import file_of_tests

CERTIFICATES = file_of_tests("support/certificates")
CERTIFICATE, KEY = str(CERTIFICATES / "cert.pem"), str(CERTIFICATES / "key.pem")


def complaint(certificate: str | None, key: str | None) -> str:
    with pytest.raises(ServerFailed) as caught:
        tls_context(certificate, key)
    return str(caught.value)


def test_a_key_without_a_certificate_does_not_disable_tls_in_silence() -> None:
    assert complaint(None, KEY) == f"the key {KEY} needs its certificate; give it with --cert"
    assert tls_context(None, None) is None
    assert tls_context(CERTIFICATE, KEY) is not None


def test_the_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    missing = str(tmp_path / "missing.pem")
    assert complaint(CERTIFICATE, missing) == f"cannot use the key {missing}: No such file or directory"
    assert complaint(missing, KEY) == f"cannot use the certificate {missing}: No such file or directory"
    needed = "a certificate and its private key, both in PEM format, are needed"
    assert complaint(CERTIFICATE, None) == f"cannot use the certificate {CERTIFICATE}: {needed}"


@pytest.mark.skipif(not shutil.which("openssl"), reason="needs openssl")
def test_a_key_with_a_passphrase_is_refused_instead_of_asking(tmp_path: Path) -> None:
    locked, other = str(tmp_path / "locked.pem"), str(tmp_path / "other.pem")
    convert = ["openssl", "pkey", "-in", KEY, "-aes256", "-passout", "pass:secret", "-out", locked]
    subprocess.run(convert, check=True)
    subprocess.run(["openssl", "genpkey", "-algorithm", "RSA", "-out", other], check=True, stderr=-3)

    assert f"cannot use the key {locked}: it has a passphrase. Try: " in complaint(CERTIFICATE, locked)
    what = f"cannot use the certificate {CERTIFICATE} with the key {other}"
    assert complaint(CERTIFICATE, other) == f"{what}: the key belongs to another certificate"

"""A fleet's certificate authority: a folder with its key, the list of members, and their certificates.

Members have client certificates only, so that a member cannot pose as a router. Routers accept the members in
the list; revoking a member removes its name from the list.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.extras import missing
from pipros.basics.input_file import read_file
from pipros.basics.replaced_file import naming, overwritten_file
from pipros.basics.windows import replace_file
from pipros_fleet.access import ROUTER, FleetRole, access_rules
from pipros_fleet.directory import read_json
from pipros_fleet.key_files import AUTHORITY, AUTHORITY_KEY, CERTIFICATE, KEY, MEMBERS, NAME, read_keys
from pipros_fleet.keys import member_name
from pipros_fleet.zenoh_session import Tls

try:
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
except ImportError as error:
    raise missing("certificates need cryptography", "pipros-fleet", error) from error

AUTHORITY_DAYS: Final = 3650
MEMBER_DAYS: Final = 365
_MEMBERS_BYTES: Final = 4 * 1024 * 1024


class KeysFailed(PiprosError):
    """A certificate cannot be issued, or the folder cannot be read or written."""


class Authority:
    """A fleet's certificate authority, stored in a folder.

    Attributes:
        folder: the path of the folder.
        members_file: the path of the list of members, which routers watch.
    """

    def __init__(self, folder: str | Path) -> None:
        """Open an existing folder.

        Raises:
            KeysFailed: the folder has no authority.
        """
        self.folder = Path(folder)
        self.members_file = self.folder / MEMBERS
        if not (self.folder / AUTHORITY).is_file():
            raise KeysFailed(f"[{folder}] has no authority; `pipros fleet keys create {folder}` creates one")

    @classmethod
    def create(cls, folder: str | Path, days: int = MEMBER_DAYS) -> Authority:
        """Create an authority, and a certificate for its routers that is valid for `days` days.

        Raises:
            KeysFailed: the folder already has an authority, or cannot be written.
        """
        folder = Path(folder)
        if (folder / AUTHORITY).exists():
            raise KeysFailed(f"[{folder}] already has an authority")
        key = ec.generate_private_key(ec.SECP256R1())
        name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "pipros fleet")])
        certificate = (
            _builder(name, name, key, AUTHORITY_DAYS)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .sign(key, hashes.SHA256())
        )
        try:
            with _writable_by_owner_only(), _completed(folder) as made:
                _write_key(made / AUTHORITY_KEY, key)
                (made / AUTHORITY).write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
                authority = cls(made)
                authority._replace_members({})
                authority._issued(ROUTER, days, is_router=True)
        except OSError as error:
            raise KeysFailed(f"cannot write [{folder}]: {error.strerror or error}") from None
        return cls(folder)

    def members(self) -> dict[str, FleetRole]:
        """Return the listed members with their roles.

        Raises:
            KeysFailed: the list cannot be read.
        """
        try:
            found = read_json(read_file(self.members_file, _MEMBERS_BYTES))
            return {member_name(name): FleetRole(role) for name, role in found.items()}
        except (OSError, ValueError, AttributeError) as error:
            raise KeysFailed(f"cannot read {self.members_file}: {error}") from None

    def add(self, name: str, role: FleetRole = FleetRole.MEMBER, days: int = MEMBER_DAYS) -> Path:
        """Issue a certificate for a new member, and list the member. Return the folder to copy to the member.

        Raises:
            InvalidName: the name is not a legal member name.
            KeysFailed: the name is taken or reserved, or the certificate cannot be issued.
        """
        name = member_name(name)
        if name == ROUTER:
            raise KeysFailed(f"the name [{ROUTER}] is reserved for routers")
        members = self.members()
        if name in members:
            raise KeysFailed(
                f"member [{name}] already exists; `pipros fleet keys renew` renews its certificate"
            )
        folder = self._issue(name, days)
        self._write_members({**members, name: role})
        return folder

    def renew(self, name: str, days: int = MEMBER_DAYS) -> Path:
        """Issue a new certificate for a member or the routers. Return the folder that contains it.

        Raises:
            KeysFailed: there is no member with this name, or the certificate cannot be issued.
        """
        if name != ROUTER and name not in self.members():
            raise KeysFailed(f"there is no member [{name}]")
        return self._issue(name, days, is_router=name == ROUTER)

    def revoke(self, name: str) -> None:
        """Remove a member from the list, and delete its folder.

        Running routers close the member's link within two seconds.

        Raises:
            KeysFailed: there is no member with this name.
        """
        members = self.members()
        if name not in members:
            raise KeysFailed(f"there is no member [{name}]")
        del members[name]
        self._write_members(members)
        shutil.rmtree(self.folder / name, ignore_errors=True)

    def router_tls(self) -> Tls:
        """Return the routers' certificate files."""
        return read_keys(self.folder / ROUTER).tls

    def access(self) -> dict[str, object]:
        """Return the access rules for the listed members; see `access_rules`."""
        return access_rules(self.members())

    def _issue(self, name: str, days: int, *, is_router: bool = False) -> Path:
        try:
            return self._issued(name, days, is_router=is_router)
        except (OSError, ValueError) as error:
            raise KeysFailed(f"cannot issue a certificate in [{self.folder}]: {error}") from None

    def _issued(self, name: str, days: int, *, is_router: bool) -> Path:
        issuer_key = serialization.load_pem_private_key(read_file(self.folder / AUTHORITY_KEY), None)
        issuer = x509.load_pem_x509_certificate(read_file(self.folder / AUTHORITY))
        if not isinstance(issuer_key, ec.EllipticCurvePrivateKey):
            raise KeysFailed(f"{self.folder / AUTHORITY_KEY} must be an elliptic curve private key")
        key = ec.generate_private_key(ec.SECP256R1())
        usages = [ExtendedKeyUsageOID.CLIENT_AUTH]
        if is_router:
            usages.append(ExtendedKeyUsageOID.SERVER_AUTH)
        certificate = (
            _builder(_name(name), issuer.subject, key, days)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(x509.ExtendedKeyUsage(usages), critical=True)
            .add_extension(x509.SubjectAlternativeName([x509.DNSName(name)]), critical=False)
            .sign(issuer_key, hashes.SHA256())
        )
        folder = self.folder / name
        with _writable_by_owner_only(), _completed(folder) as made:
            _write_key(made / KEY, key)
            (made / CERTIFICATE).write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
            (made / NAME).write_text(f"{name}\n")
            (made / AUTHORITY).write_bytes(read_file(self.folder / AUTHORITY))
        return folder

    def _write_members(self, members: Mapping[str, FleetRole]) -> None:
        try:
            self._replace_members(members)
        except OSError as error:
            raise KeysFailed(f"cannot write {self.members_file}: {error.strerror or error}") from None

    def _replace_members(self, members: Mapping[str, FleetRole]) -> None:
        text = json.dumps({name: role.value for name, role in sorted(members.items())}, indent=1)
        with _writable_by_owner_only(), overwritten_file(self.members_file) as file:
            file.write(f"{text}\n".encode())


@contextlib.contextmanager
def _completed(folder: Path) -> Iterator[Path]:
    """Yield a new folder. At the end, its files replace those in `folder`, which stay if the block fails."""
    with naming(folder):
        folder.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(prefix=".", dir=folder))
        try:
            yield made
            for each in sorted(made.iterdir(), reverse=True):  # the authority last
                replace_file(each, folder / each.name)
        finally:
            shutil.rmtree(made, ignore_errors=True)
            with contextlib.suppress(OSError):
                folder.rmdir()  # which fails unless it is empty


@contextlib.contextmanager
def _writable_by_owner_only() -> Iterator[None]:
    """Make new files and folders in the block writable only by their owner, regardless of the umask."""
    before = os.umask(0o022)
    os.umask(before | 0o022)
    try:
        yield
    finally:
        os.umask(before)


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, days: int
) -> x509.CertificateBuilder:
    now = datetime.now(timezone.utc)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))  # a robot's clock may be behind
        .not_valid_after(now + timedelta(days=days))
    )


def _write_key(path: Path, key: ec.EllipticCurvePrivateKey) -> None:
    """Write a private key to a new file that is created readable only by its owner."""
    content = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    path.unlink(missing_ok=True)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with open(descriptor, "wb") as file:
        file.write(content)

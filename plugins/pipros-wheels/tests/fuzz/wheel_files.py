"""Any list of repositories, file of keys, name of a wheel and wheel is read, or refused with a PiprosError.

python -m tests.fuzz.wheel_files --seconds 60
"""

import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros_wheels.index import metadata_of_wheel, read_wheel_name
from pipros_wheels.names import distribution_name, is_requirement
from pipros_wheels.python_keys import read_keys
from pipros_wheels.sources import read_repositories, read_repository
from tests.fuzz import mutation

WORDS = [
    *(b"- git:", b"uri: ", b"url: ", b"type: git", b"repositories:", b"version: ", b"local-name: a"),
    *(b"https://e.org/a.git", b"git@e.org:a", b"ext::sh", b"--upload-pack", b"@v1", b"{", b"}", b"&a", b"*a"),
    *(b"my_key: ", b"pyserial>=3.5", b"; python_version", b"[extra]", b"-py3-none-any.whl", b"1.0", b"1!2.0"),
    *(b"PK\x03\x04", b"PK\x05\x06", b".dist-info/METADATA", b"Requires-Python: ", b"\xff\xff\xff\xff"),
]
LONGER = (2000,)


def target(data: bytes) -> None:
    text = data.decode("utf-8", "replace")
    with tempfile.TemporaryDirectory() as name:
        for ending in ("rosinstall", "repos", "yaml", "whl"):
            file = Path(name, f"file.{ending}")
            file.write_bytes(data)
            with suppress(PiprosError):
                if ending == "yaml":
                    assert all(not value or is_requirement(value) for value in read_keys(str(file)).values())
                elif ending == "whl":
                    assert all(isinstance(value, str) for value in metadata_of_wheel(file).values())
                else:
                    assert not any(found.url.startswith("-") for found in read_repositories(file))
    with suppress(PiprosError):
        found = read_repository(text)
        assert found is None or not found.version.startswith("-")
    with suppress(PiprosError):
        assert "/" not in "".join(read_wheel_name(text))
    with suppress(PiprosError):
        assert is_requirement(distribution_name(text))


if __name__ == "__main__":
    sys.exit(mutation.main(target, "wheel_files", WORDS, LONGER))

"""Unix sockets in a folder of this user."""

import os
from pathlib import Path

import pytest

from pipros.basics.cache_files import CacheFolder, Untrusted
from pipros.net import local_socket

pytestmark = pytest.mark.skipif(not local_socket.HAS_LOCAL_SOCKETS, reason="needs Linux")


@pytest.fixture
def folder(tmp_path: Path) -> CacheFolder:
    """A folder whose path is longer than that of a socket may be."""
    return CacheFolder(str(tmp_path / ("x" * 120) / "sockets"))


def test_a_listening_socket_is_reached_below_a_long_path(folder: CacheFolder) -> None:
    with local_socket.listen(folder, "1") as server, local_socket.connect(folder, "1", 30.0) as client:
        accepted, _ = server.accept()
        with accepted:
            assert local_socket.peer_user(accepted) == local_socket.peer_user(client) == os.geteuid()
            client.sendall(b"hello")
            assert accepted.recv(5) == b"hello"
    assert folder.names() == ["1"]


def test_a_socket_of_another_user_is_refused(folder: CacheFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    with local_socket.listen(folder, "1"):
        monkeypatch.setattr(local_socket, "peer_user", lambda _: 4711)
        with pytest.raises(Untrusted, match="the socket 1 belongs to another user"):
            local_socket.connect(folder, "1", 30.0)


def test_a_folder_that_others_can_write_to_is_refused(folder: CacheFolder, tmp_path: Path) -> None:
    local_socket.listen(folder, "1").close()
    (tmp_path / ("x" * 120) / "sockets").chmod(0o777)
    with pytest.raises(Untrusted):
        local_socket.listen(folder, "1")
    with pytest.raises(Untrusted):
        local_socket.connect(folder, "1", 30.0)


def test_only_sockets_of_ended_programs_are_removed(folder: CacheFolder) -> None:
    local_socket.remove_dead(folder)  # there is no folder yet
    local_socket.listen(folder, "1").close()
    with local_socket.listen(folder, "2"):
        folder.write("3", b"not a socket")
        local_socket.remove_dead(folder)
        assert "2" in folder.names()
    assert "1" not in folder.names()


def test_a_socket_replaces_that_of_an_ended_program(folder: CacheFolder) -> None:
    local_socket.listen(folder, "1").close()
    with local_socket.listen(folder, "1"):
        local_socket.connect(folder, "1", 30.0).close()


def test_a_malformed_name_leaves_no_file_behind(folder: CacheFolder) -> None:
    with pytest.raises(OSError, match="No such file"):
        local_socket.listen(folder, "no/such")
    assert folder.names() == []
    with pytest.raises(OSError, match="No such file"):
        local_socket.connect(folder, "1", 30.0)

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from pipros_workspace.catkin.project import Download
from pipros_workspace.run_tests import fetch

CONTENT = b"a bag"
MD5 = hashlib.md5(CONTENT, usedforsecurity=False).hexdigest()


class Files(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200 if self.path == "/x.bag" else 404)
        self.end_headers()
        self.wfile.write(CONTENT)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 # as in the base
        pass


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with ThreadingHTTPServer(("127.0.0.1", 0), Files) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.mark.parametrize("md5", ["", MD5])
def test_a_file_is_downloaded_once(url: str, tmp_path: Path, md5: str) -> None:
    lines: list[str] = []
    download = Download(f"{url}/x.bag", str(tmp_path / "below" / "x.bag"), md5)
    fetch(download, lines.append)
    fetch(download, lines.append)
    assert (tmp_path / "below" / "x.bag").read_bytes() == CONTENT
    assert lines == [f"-- Downloading {url}/x.bag to {tmp_path / 'below' / 'x.bag'}"]
    assert [path.name for path in (tmp_path / "below").iterdir()] == ["x.bag"]


def test_a_file_with_another_content_is_replaced(url: str, tmp_path: Path) -> None:
    (tmp_path / "x.bag").write_text("old")
    fetch(Download(f"{url}/x.bag", str(tmp_path / "x.bag"), MD5), lambda _line: None)
    assert (tmp_path / "x.bag").read_bytes() == CONTENT


def test_a_wrong_content_is_not_kept(url: str, tmp_path: Path) -> None:
    lines: list[str] = []
    fetch(Download(f"{url}/x.bag", str(tmp_path / "x.bag"), "0" * 32), lines.append)
    assert lines[-1] == f"-- WARNING: the MD5 of {url}/x.bag must be {'0' * 32}, got {MD5}"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", ["{url}/missing", "file:///etc/passwd", "ftp://127.0.0.1/x", "nonsense"])
def test_failed_downloads_are_warnings(url: str, tmp_path: Path, path: str) -> None:
    lines: list[str] = []
    fetch(Download(path.format(url=url), str(tmp_path / "x.bag")), lines.append)
    assert "cannot be downloaded" in lines[-1]
    assert not (tmp_path / "x.bag").exists()

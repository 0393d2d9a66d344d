"""resource_retriever: supported and refused URLs."""

import http.server
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import rospkg

import resource_retriever


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "arm_description"
    (folder / "meshes").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>arm_description</name></package>")
    (folder / "meshes" / "lower arm#1.stl").write_bytes(b"solid")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    return folder


def test_the_file_of_a_package_is_read(package: Path) -> None:
    url = "package://arm_description/meshes/lower arm#1.stl"

    assert resource_retriever.get(url) == b"solid"
    assert resource_retriever.get_filename(url) == f"file://{package}/meshes/lower arm#1.stl"
    assert resource_retriever.get_filename(url, use_protocol=False) == f"{package}/meshes/lower arm#1.stl"


def test_the_file_of_a_file_url_is_read(package: Path) -> None:
    path = f"{package}/meshes/lower%20arm%231.stl"

    assert resource_retriever.get(f"file://{path}") == b"solid"
    assert resource_retriever.get(f"file://localhost{path}") == b"solid"
    assert resource_retriever.get_filename(f"file://{path}") == f"file://{path}"


@pytest.mark.parametrize(("url", "text"), [
    ("file:///nowhere/x", "Invalid URL: file:///nowhere/x .*No such file"),
    ("file://elsewhere/x", "must start with package:// or file:///"),
    ("ftp://server/x", "must start with package:// or file:///"),
    ("/etc/hostname", "Invalid URL: /etc/hostname"), ("", "Invalid URL: "),
    ("package://arm_description", "Could not parse package:// format into file:// format for package://arm"),
    ("http://[", "Invalid URL: http://"),
])  # fmt: skip
def test_invalid_and_missing_urls_are_refused(url: str, text: str) -> None:
    with pytest.raises(Exception, match=text):
        resource_retriever.get(url)


def test_a_package_that_does_not_exist_is_named() -> None:
    with pytest.raises(rospkg.ResourceNotFound, match="no_such_package"):
        resource_retriever.get("package://no_such_package/mesh.stl")


class Handler(http.server.BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"mesh")

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def web_server() -> Iterator[str]:
    server = http.server.HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/mesh.stl"
    server.shutdown()
    thread.join()
    server.server_close()


def test_web_servers_are_asked_only_where_the_environment_allows(web_server: str, monkeypatch) -> None:
    with pytest.raises(Exception, match="require PIPROS_RESOURCES_BY_HTTP=1"):
        resource_retriever.get(web_server)

    monkeypatch.setenv("PIPROS_RESOURCES_BY_HTTP", "1")
    assert resource_retriever.get(web_server) == b"mesh"

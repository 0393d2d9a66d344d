"""The page on a network: `--bind`, certificates, and messages about them. The network is 127.0.0.2."""

import asyncio
import gc
import hashlib
import http.client
import json
import re
import shlex
import ssl
import subprocess
import sys
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets import Origin
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from tests.support import documents
from tests.support.environments import file_of_tests
from tests.support.ros import RosSystem

CERTIFICATES = file_of_tests("support/certificates")
FINGERPRINT = hashlib.sha256(ssl.PEM_cert_to_DER_cert((CERTIFICATES / "cert.pem").read_text())).hexdigest()
HOST = "127.0.0.2"

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="127.0.0.2 is an address on Linux only"),
    # Python 3.10 warns about an aborted transport, with which a refused handshake ends.
    pytest.mark.filterwarnings("ignore:unclosed transport <asyncio.sslproto:ResourceWarning"),
]


def trusting(certificate: Path = CERTIFICATES / "cert.pem") -> ssl.SSLContext:
    """Trust a certificate, and check the names in the test's."""
    context = ssl.create_default_context(cafile=str(certificate))
    context.check_hostname = certificate.is_relative_to(CERTIFICATES)
    return context


async def about(place: str, token: str, scheme: str, trust: ssl.SSLContext, **request: Any) -> Any:
    """Return the answer to a request, over TLS, where the threaded client loses requests."""
    async with connect(
        f"wss://{place}/live", origin=Origin(f"{scheme}://{place}"), ssl=trust, proxy=None, open_timeout=60
    ) as browser:
        await browser.send(json.dumps({"token": token}))
        assert json.loads(await browser.recv()) == {"id": 0, "data": {"token": token}}
        await browser.send(json.dumps({"id": 1, "action": "about", **request}))
        return json.loads(await browser.recv())


@pytest.mark.parametrize("is_one_file", [False, True])
def test_a_certificate_makes_everything_https(ros: RosSystem, tmp_path: Path, is_one_file: bool) -> None:
    ros.serve_master()
    cert, key = CERTIFICATES / "cert.pem", CERTIFICATES / "key.pem"
    files: tuple[str | Path, ...] = ("--cert", cert, "--key", key)
    if is_one_file:
        both = tmp_path / "both.pem"
        both.write_text(key.read_text() + cert.read_text())
        files = ("--cert", both)
    server = ros.pipros.start("rqt_graph", "--no-browser", "--bind", f"{HOST}:0", *files)
    url = urlsplit(server.wait_for(r"https://\S+")[0])
    assert url.hostname == HOST
    server.wait_for("Others on this network can see the system if they have this address.")
    said = server.wait_for("Encrypted with TLS; the certificate's SHA-256 fingerprint is ([0-9A-F:]{95})")[1]
    assert said.replace(":", "").lower() == FINGERPRINT

    connection = http.client.HTTPSConnection(url.netloc, context=trusting(), timeout=30)
    connection.request("GET", "/")
    answer = connection.getresponse()
    assert answer.status == 200
    assert b"app.js" in answer.read()

    token = url.fragment.removeprefix("token=").partition("/")[0]
    told = asyncio.run(about(url.netloc, token, "https", trusting()))["data"]
    assert told["master"] == ros.master_uri
    with pytest.raises(InvalidStatus) as refused:
        asyncio.run(about(url.netloc, token, "http", trusting()))
    assert refused.value.response.status_code == 403
    del refused
    gc.collect()  # collect that transport while its warning is ignored

    plain = http.client.HTTPConnection(url.netloc, timeout=30)
    plain.request("GET", "/")
    with pytest.raises((http.client.HTTPException, OSError)):
        plain.getresponse()
    server.press_ctrl_c()
    assert server.wait() == 0


def test_a_colleague_sees_the_documented_page_and_cannot_change_anything(ros: RosSystem) -> None:
    ros.serve_master()
    certify, serve = re.findall(r"(?m)^(?:openssl|rqt -).*", documents.text_of("how/see-in-a-browser.md"))
    subprocess.run(certify, shell=True, cwd=ros.home, check=True, capture_output=True)  # noqa: S602
    server = ros.pipros.start(*shlex.split(serve.replace("0.0.0.0:8443", f"{HOST}:0")))
    url = urlsplit(server.wait_for(r"https://\S+")[0])
    way = (url.netloc, url.fragment.removeprefix("token="), "https", trusting(ros.home / "cert.pem"))
    assert asyncio.run(about(*way))["data"]["may"] == []
    refused = asyncio.run(about(*way, action="set_param", name="/x", value="1"))
    assert "start it with --control" in refused["error"]


def test_without_a_certificate_it_says_that_nothing_is_encrypted(ros: RosSystem) -> None:
    ros.serve_master()
    server = ros.pipros.start("rqt_graph", "--no-browser", "--control", "--bind", HOST)
    url = urlsplit(server.wait_for(r"http://\S+")[0])
    server.wait_for("Others on this network can see and change the system if they have this address.")
    server.wait_for("The connection is not encrypted; --cert and --key encrypt it.")
    connection = http.client.HTTPConnection(url.netloc, timeout=30)
    connection.request("GET", "/")
    assert connection.getresponse().status == 200


@pytest.mark.parametrize(("key", "text"), [
    ("other.pem", f"cannot use the certificate {CERTIFICATES}/cert.pem"),
    ("/dev/null", "cannot use the key /dev/null: it is not a regular file"),
])  # fmt: skip
def test_a_key_of_another_certificate_is_refused(ros: RosSystem, tmp_path: Path, key: str, text: str) -> None:
    (tmp_path / "other.pem").write_text("")
    ros.serve_master()
    done = ros.pipros.run(
        "rqt_graph", "--no-browser", "--cert", CERTIFICATES / "cert.pem", "--key", tmp_path / key
    )
    assert done.returncode == 1
    assert text in done.output

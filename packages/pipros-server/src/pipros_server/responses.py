"""The HTTP responses of servers of pages: files, compressed if the browser allows it, and texts."""

from __future__ import annotations

import functools
import gzip
import hashlib
import mimetypes
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from importlib import resources
from typing import TYPE_CHECKING, Final

from websockets.datastructures import Headers
from websockets.http11 import Response

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable


IMPORT_MAP_HASH: Final = "'sha256-Rs1Z8l1yan6qXH3TNpnX8JNJIBzU2YQ04wCSxEwgCNM='"
"""Hash of the only inline script in index.html: the import map, which names third-party modules."""
BUNDLED_INDEX: Final = "bundle/index.html"
"""Sent for `/` by pages that have a bundle of their modules; `/index.html` is the page of the modules."""

SECURITY_HEADERS = {
    "Content-Security-Policy": f"default-src 'none'; script-src 'self' {IMPORT_MAP_HASH}; style-src 'self'; "
    "connect-src 'self'; "
    "img-src 'self' blob: data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def only_header(headers: Headers, name: str) -> str | None:
    """Return the value of a header, or None if it is missing or occurs more than once."""
    values = headers.get_all(name)
    return values[0] if len(values) == 1 else None


def file_response(path: str, packages: Sequence[str], request: Headers) -> Response:
    """Return a file of the page, compressed if the browser accepts this.

    Each part of the path is looked up among the entries of a folder, so no other file can be read. Browsers
    keep files, but ask each time whether their content has changed.
    """
    names = (BUNDLED_INDEX, "index.html") if path == "/" else (path[1:],)
    files = (_find(resources.files(package) / "page", name) for name in names for package in packages)
    file = next((file for file in files if file is not None), None)
    if file is None:
        return plain_response(HTTPStatus.NOT_FOUND, "This file does not exist.")
    kind = "text/javascript" if file.name.endswith(".js") else mimetypes.guess_type(file.name)[0]
    kind = kind or "application/octet-stream"
    charset = "; charset=utf-8" if kind.startswith(("text/", "image/svg")) else ""
    body = file.read_bytes()
    tag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
    extra = {"ETag": tag, "Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
    if only_header(request, "If-None-Match") == tag:
        return html_response(HTTPStatus.NOT_MODIFIED, b"", kind + charset, extra)
    if "gzip" in (only_header(request, "Accept-Encoding") or ""):
        body = _compressed(body)
        extra["Content-Encoding"] = "gzip"
    return html_response(HTTPStatus.OK, body, kind + charset, extra)


@functools.lru_cache(maxsize=32)
def _compressed(body: bytes) -> bytes:
    return gzip.compress(body, 6, mtime=0)


def _find(folder: Traversable, name: str) -> Traversable | None:
    file = folder
    for part in name.split("/"):
        if not file.is_dir():
            return None
        found = next((child for child in file.iterdir() if child.name == part), None)
        if found is None:
            return None
        file = found
    return file if file.is_file() else None


def plain_response(status: HTTPStatus, text: str, kind: str = "text/plain") -> Response:
    """Return a response that contains `text`, with the media type `kind`."""
    return html_response(status, text.encode(), f"{kind}; charset=utf-8")


def html_response(
    status: HTTPStatus, body: bytes, kind: str, extra: Mapping[str, str] | None = None
) -> Response:
    headers = {
        "Content-Type": kind,
        "Content-Length": str(len(body)),
        "Connection": "close",
        **SECURITY_HEADERS,
        **(extra or {}),
    }
    return Response(status.value, status.phrase, Headers(headers), body)

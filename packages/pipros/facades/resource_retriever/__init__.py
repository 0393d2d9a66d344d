"""Drop-in replacement for Noetic's resource_retriever: read files from package:// and file:// URLs."""

from __future__ import annotations

import os
from urllib.parse import urlsplit
from urllib.request import url2pathname, urlopen

from pipros.basics.input_file import read_file
from pipros.basics.limits import process_limits
from pipros.basics.windows import file_url

PACKAGE_PREFIX = "package://"

HTTP_VARIABLE = "PIPROS_RESOURCES_BY_HTTP"
"""Environment variable that enables http:// and https:// URLs in `get` if set to 1."""

_HTTP_TIMEOUT_S = 30.0


def get_filename(url: str, use_protocol: bool = True) -> str:
    """Convert a package:// URL to a file:// URL, or to a path if `use_protocol` is False.

    Other URLs are returned unchanged.

    Raises:
        Exception: the URL does not contain a path within the package.
        rospkg.ResourceNotFound: the package does not exist.
    """
    if not url.startswith(PACKAGE_PREFIX):
        return url
    package, slash, path = url.removeprefix(PACKAGE_PREFIX).partition("/")
    if not slash:
        raise Exception(f"Could not parse package:// format into file:// format for {url}")
    import rospkg

    folder = rospkg.RosPack().get_path(package)
    return f"{file_url(folder) if use_protocol else folder}/{path}"


def get(url: str) -> bytes:
    """Return the contents of the file at a package:// or file:// URL.

    URLs often arrive in messages from other nodes. Therefore http:// and https:// are rejected unless
    PIPROS_RESOURCES_BY_HTTP=1 is set, so that other nodes cannot make this process send requests. Requests
    have a timeout of 30 s.

    Raises:
        Exception: the file cannot be read. The message contains the URL and the reason.
        rospkg.ResourceNotFound: the package does not exist.
    """
    filename = get_filename(url)
    try:
        parts = urlsplit(filename)
        if parts.scheme in ("http", "https"):
            return _from_web_server(filename)
        if parts.scheme != "file" or parts.netloc not in ("", "localhost"):
            raise ValueError("URL must start with package:// or file:///")
        # ? and # may be part of a file name, although they end the path of a URL.
        path = filename.partition("://")[2].removeprefix(parts.netloc).replace("?", "%3F").replace("#", "%23")
        return read_file(url2pathname(path))
    except (OSError, ValueError) as error:
        raise Exception(f"Invalid URL: {filename} ({error})") from error


def _from_web_server(url: str) -> bytes:
    if os.environ.get(HTTP_VARIABLE) != "1":
        raise ValueError(f"http:// and https:// require {HTTP_VARIABLE}=1 in the environment")
    limit = process_limits().file_bytes
    with urlopen(url.replace(" ", "%20"), timeout=_HTTP_TIMEOUT_S) as response:  # noqa: S310 # the caller has checked the scheme
        content = bytes(response.read(limit + 1))
    if len(content) > limit:
        raise ValueError(f"it is larger than {limit} bytes")
    return content

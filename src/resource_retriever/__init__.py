"""resource_retriever, as Noetic has it: what is in the files that package:// and file:// URLs name."""

from __future__ import annotations

import os
from urllib.parse import urlsplit
from urllib.request import url2pathname, urlopen

PACKAGE_PREFIX = "package://"

HTTP_VARIABLE = "PIPROS_RESOURCES_BY_HTTP"
"""The environment variable that, when it is 1, lets `get` ask web servers."""

_HTTP_TIMEOUT_S = 30.0


def get_filename(url: str, use_protocol: bool = True) -> str:
    """The URL with file:// for package://, or the path alone. Other URLs stay as they are.

    Raises:
        Exception: it does not say which file of the package.
        rospkg.ResourceNotFound: the package does not exist.
    """
    if not url.startswith(PACKAGE_PREFIX):
        return url
    package, slash, path = url.removeprefix(PACKAGE_PREFIX).partition("/")
    if not slash:
        raise Exception(f"Could not parse package:// format into file:// format for {url}")
    import rospkg

    folder = rospkg.RosPack().get_path(package)
    return f"{'file://' if use_protocol else ''}{folder}/{path}"


def get(url: str) -> bytes:
    """What the file of a package:// or file:// URL holds.

    A URL often comes from a message, so from another node. Therefore http:// and https:// are refused, unless
    the environment has PIPROS_RESOURCES_BY_HTTP=1: nobody else shall make this process ask web servers.

    Raises:
        Exception: it cannot be read; the text has the URL and says why.
        rospkg.ResourceNotFound: the package does not exist.
    """
    filename = get_filename(url)
    try:
        parts = urlsplit(filename)
        if parts.scheme in ("http", "https"):
            return _from_web_server(filename)
        if parts.scheme != "file" or parts.netloc not in ("", "localhost"):
            raise ValueError("the URL must begin with package:// or file:///")
        # A file's name may have the characters that a URL ends a path with.
        path = filename.partition("://")[2].removeprefix(parts.netloc).replace("?", "%3F").replace("#", "%23")
        with open(url2pathname(path), "rb") as file:
            return file.read()
    except (OSError, ValueError) as error:
        raise Exception(f"Invalid URL: {filename} ({error})") from error


def _from_web_server(url: str) -> bytes:
    if os.environ.get(HTTP_VARIABLE) != "1":
        raise ValueError(f"web servers are not asked without {HTTP_VARIABLE}=1 in the environment")
    with urlopen(url, timeout=_HTTP_TIMEOUT_S) as answer:  # noqa: S310 # get lets only http and https come here
        return bytes(answer.read())

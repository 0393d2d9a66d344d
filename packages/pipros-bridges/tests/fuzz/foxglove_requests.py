"""Any message from a Foxglove client is a request, or raises an error that names the fault.

An input begins with `t` for text or `b` for binary data. Parameters and assets of the request are read, too.

python -m tests.fuzz.foxglove_requests --seconds 60
"""

import contextlib
import json
import sys
import tempfile
from pathlib import Path

from pipros.basics.input_file import read_file
from pipros.packages.assets import AssetRefused, read_asset
from pipros_bridges.foxglove.frames import parameter_values
from pipros_bridges.foxglove.parameters import InvalidClientParameter, from_client, to_client
from pipros_bridges.foxglove.requests import (
    READERS,
    FetchAsset,
    MalformedRequest,
    SetParameters,
    read_request,
)
from tests.fuzz import mutation

WORDS = [
    b't{"op": "subscribe", "subscriptions": [{"id": 0, "channelId": 1}]}',
    b't{"op": "advertise", "channels": [{"id": 1, "topic": "/a", "encoding": "json", "schemaName": "p/T"}]}',
    b't{"op": "setParameters", "parameters": [{"name": "/a", "value": 1, "type": "float64"}], "id": "1"}',
    b't{"op": "fetchAsset", "uri": "package://p/meshes/a.stl", "requestId": 1}',
    b"b\x01\x01\x00\x00\x00body",
    b"b\x02\x01\x00\x00\x00\x02\x00\x00\x00\x04\x00\x00\x00ros1body",
    *(b"4294967296", b"-1", b"1e400", b"NaN", b"null", b"true", b"[[", b'"byte_array"', b'"float64_array"'),
    *(f'"{name}"'.encode() for name in READERS),
    *(b"../", b"%2e%2e/", b"\\u0000", b"\xff\xff\xff\xff", b'"AA=="'),
]
_FOLDER = Path(tempfile.gettempdir())


def target(data: bytes) -> None:
    kind, body = data[:1], data[1:]
    try:
        request = read_request(body.decode("utf-8", "replace") if kind == b"t" else body)
    except MalformedRequest:
        return
    match request:
        case SetParameters():
            for parameter in request.parameters:
                if parameter.get("value") is None:
                    continue
                with contextlib.suppress(InvalidClientParameter):
                    value = from_client(parameter)
                    [frame] = parameter_values([to_client(parameter["name"], value)]).parts
                    json.loads(frame)
        case FetchAsset():
            with contextlib.suppress(AssetRefused):
                found = read_asset(request.uri, lambda _: [_FOLDER / "none"], 1000, read_file)
                raise AssertionError(f"{request.uri} was read: {found!r}")


if __name__ == "__main__":
    sys.exit(mutation.main(target, "foxglove_requests", WORDS))

"""`pipros clients`: lists the clients of a bridge, with the topics that each receives and publishes."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pipros_bridges.commands.serve import PORT
from pipros_tools.cli.runner import CommandError, option_parser, run

TIMEOUT_S = 10.0
LIMIT_BYTES = 16 * 1024 * 1024


def main(argv: Sequence[str] | None = None) -> int:
    return run(lambda: _main(sys.argv[1:] if argv is None else argv))


def _main(argv: Sequence[str]) -> int:
    parser = option_parser("pipros clients", "[HOST:PORT or address] [options]")
    parser.add_option("--token-file", metavar="FILE", help="file with the server's tokens")
    parser.add_option(
        "--token", help="the server's token; other users of this machine can read command lines"
    )
    parser.add_option("--cert", metavar="FILE", help="the server's certificate, if it uses TLS")
    options, arguments = parser.parse_args(list(argv))
    if len(arguments) > 1:
        parser.error(f"unexpected argument: {arguments[1]}")
    place = arguments[0] if arguments else f"localhost:{PORT}"
    token = options.token
    if options.token_file:
        from pipros_server.token_file import read_tokens

        token = read_tokens(options.token_file)[0]
    rows = _clients(place, token, options.cert)
    print(f"{len(rows)} client{'' if len(rows) == 1 else 's'}")
    for row in rows:
        print("\n".join(_lines(row)))
    return 0


def _clients(place: str, token: str | None, certificate: str | None) -> list[Mapping[str, Any]]:
    """Return the rows of `GET /clients`. `place` is HOST:PORT, or the URL that a server prints."""
    import contextlib
    import http.client
    import json
    import ssl

    scheme, _, place = place.rpartition("://")
    place = place.partition("/")[0]
    is_encrypted = certificate is not None or scheme in ("https", "wss")
    headers = {} if token is None else {"Authorization": f"Bearer {token}"}
    try:
        if not is_encrypted:
            connection = http.client.HTTPConnection(place, timeout=TIMEOUT_S)
        else:
            context = ssl.create_default_context(cafile=certificate)
            connection = http.client.HTTPSConnection(place, timeout=TIMEOUT_S, context=context)
        with contextlib.closing(connection):
            connection.request("GET", "/clients", headers=headers)
            answer = connection.getresponse()
            text = answer.read(LIMIT_BYTES).decode("utf-8", "replace")
        if answer.status == http.HTTPStatus.FORBIDDEN and "Authorization" in text and token is None:
            raise CommandError(f"{place} requires a token; use --token-file FILE")
        if answer.status != http.HTTPStatus.OK:
            raise CommandError(f"{place} refused the request: {text}")
        rows: list[Mapping[str, Any]] = json.loads(text)
    except (OSError, ValueError, RecursionError, http.client.HTTPException) as error:
        hint = ""
        if isinstance(error, http.client.RemoteDisconnected) and not is_encrypted:
            hint = "; if it uses TLS, --cert FILE names its certificate"
        raise CommandError(f"no bridge responds at {place}: {error}{hint}") from None
    return rows


def _lines(row: Mapping[str, Any]) -> Iterator[str]:
    from pipros.basics.printable import printable

    agent = f" ({printable(row['agent'], 60)})" if row["agent"] else ""
    yield f"\n{row['number']}: {row['protocol']} from {row['address']}{agent}"
    for topic, traffic in row["topics"].items():
        yield f"  receives {printable(topic)}: {_traffic(traffic)}"
    for topic in row["publishes"]:
        yield f"  publishes {printable(topic)}"
    waiting = f"; {row['waiting_bytes']} bytes queued" if row["waiting_bytes"] else ""
    yield f"  total sent: {_traffic(row['sent'])}{waiting}"


def _traffic(counts: Mapping[str, int]) -> str:
    lost = f", {counts['lost']} lost" if counts["lost"] else ""
    return f"{counts['messages']} messages, {counts['bytes']} bytes{lost}"

"""Decide whether the server at an address is a certain node, before a call there changes anything.

Any peer can register any address under any name: that of the master itself, of another master, of a launch
server, or of a program that is no part of the graph but accepts requests from its own machine only. The rule:
such an address receives only the queries below and other calls that change nothing, until its answers have
shown that the server is the node. This module performs no I/O.
"""

from __future__ import annotations

from collections.abc import Generator

Queries = Generator[str, object, bool]
"""Yields the methods to call, receives their values, and returns whether the server is the node."""


def identification(node: str) -> Queries:
    """Return the queries that show whether a server is the slave API of `node`.

    Send None as the value of a method that the server lacks or refuses.

    Python nodes report their names. Others, such as roscpp nodes, list their publications. A server with
    neither counts as a node if it has a process id, which launch servers lack, and is not a master.

    >>> queries = identification("/talker")
    >>> next(queries)
    'getName'
    """
    name = yield "getName"
    if isinstance(name, str) and name:
        return name == node
    if isinstance((yield "getPublications"), list):
        return True
    if (yield "getPid") is None:
        return False
    return not isinstance((yield "getSystemState"), list)


def value_of(answer: object) -> object:
    """Return the value in the response `[1, text, value]`; None for any other response."""
    return answer[2] if isinstance(answer, list) and len(answer) == 3 and answer[0] == 1 else None

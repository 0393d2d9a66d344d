"""`rosservice call`."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import Any

from pipros.cli.program import CommandError, Surroundings, option_parser
from pipros.cli.rosservice.services import argument_names, service_class_of, uri_of
from pipros.names import parse_arguments
from pipros.net.master import MasterClient

LOOK_PERIOD_S = 0.05
NS_PER_S = 1_000_000_000


def call_service(argv: Sequence[str]) -> int:
    parser = option_parser("rosservice", "call /service [args...]")
    parser.add_option("-v", dest="verbose", action="store_true", default=False, help="print verbose output")
    parser.add_option(
        "--wait",
        dest="wait",
        action="store_true",
        default=False,
        help="wait for service to be advertised",
    )
    options, arguments = parser.parse_args(list(parse_arguments(argv).rest))
    if not arguments:
        parser.error("service must be specified")
    from pipros.cli.documents import documents_of, value_of

    with Surroundings("rosservice") as here:
        service = here.resolve(arguments[0])
        if options.wait:
            wait_for(here.master, service)
        caller = Caller(here.master, service)
        if arguments[1:] or not caller.takes_arguments:
            caller.print_call([value_of(word) for word in arguments[1:]], verbose=options.verbose)
            return 0
        if sys.stdin.isatty():
            parser.error("Please specify service arguments")
        for document in documents_of(sys.stdin):
            caller.print_call([document], verbose=options.verbose)
    return 0


def wait_for(master: MasterClient, service: str) -> None:
    """Waits until somebody offers the service; Ctrl-C ends it."""
    while uri_of(master, service) is None:
        time.sleep(LOOK_PERIOD_S)


class Caller:
    """Calls one service with values as people type them."""

    def __init__(self, master: MasterClient, service: str) -> None:
        """Raises:
        CommandError: nobody offers the service, or its type is not on the path.
        """
        from pipros.node.client import OpenCalls, ServiceClient

        self._class = service_class_of(master, service)
        self._client = ServiceClient(service, self._class, master=lambda: master, calls=OpenCalls())

    @property
    def takes_arguments(self) -> bool:
        return bool(self._class._request_class.__slots__)

    def request(self, values: Sequence[Any]) -> Any:
        """The request with these values: those of all fields, or one dictionary.

        Raises:
            CommandError: they do not fit.
        """
        from pipros.msg import load_message_class
        from pipros.msg.base import MessageException, SerializationError
        from pipros.msg.fill import fill_message_args
        from pipros.msg.time import Time

        request = self._class._request_class()
        now = Time(*divmod(time.time_ns(), NS_PER_S))
        keys = {"now": now, "auto": load_message_class("std_msgs/Header")(stamp=now)}
        try:
            fill_message_args(request, list(values), keys)
        except (MessageException, ValueError) as error:
            given = "\n".join(f" * {value} (type {type(value).__name__})" for value in values)
            raise CommandError(
                f"Incompatible arguments to call service:\n{error}\nProvided arguments are:\n{given}\n\n"
                f"Service arguments are: [{argument_names(self._class)}]"
            ) from None
        try:
            request._check_types()
        except SerializationError as error:
            raise CommandError(
                "Unable to send request. One of the fields has an incorrect type:\n"
                f"  {error}\n\nsrv file:\n{self._definition()}"
            ) from None
        return request

    def call(self, request: Any) -> Any:
        """Returns the response.

        Raises:
            ServiceFailed: the server is gone, or answered with an error.
        """
        return self._client.call(request)

    def print_call(self, values: Sequence[Any], *, verbose: bool = False) -> None:
        """Calls the service and prints its response; with `verbose` the request as well. Raises as `call`."""
        request = self.request(values)
        response = self.call(request)
        if verbose:
            print(f"{request}\n---")
        print(response, flush=True)

    def _definition(self) -> str:
        request, response = self._class._request_class, self._class._response_class
        halves = (
            "".join(f"{kind} {name}\n" for name, kind in zip(half.__slots__, half._slot_types, strict=True))
            for half in (request, response)
        )
        return "---\n".join(halves)

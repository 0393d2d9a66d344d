"""`pipros ros2 echo`, `hz`, `pub` and `call`, which print what ROS 2's own commands print."""

from __future__ import annotations

import queue
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.printable import listed, printable_lines
from pipros_ros2.commands.look import domain_view, full_name, look_parser, parsed
from pipros_tools.cli.runner import CommandError, add_flag

if TYPE_CHECKING:
    from pipros_ros2.interface import Sample
    from pipros_ros2.look import DomainView

_QUEUED: Final = 1000
_LOOK_S: Final = 0.2


def echo(argv: Sequence[str]) -> int:
    parser = look_parser("echo", "[options] /topic [type]", "Prints the messages of a topic.")
    add_flag(parser, "--once", help="print one message, then exit")
    add_flag(parser, "--no-arr", dest="no_arrays", help="print only the type and length of arrays")
    add_flag(
        parser, "-f", "--full-length", dest="is_whole", help="do not shorten arrays and texts to 128 elements"
    )
    parser.add_option("--field", metavar="FIELD", help="print only a field, such as pose.position.x")
    options, words = parsed(parser, argv, least=1, most=2)
    import yaml

    from pipros_rosbag2.interfaces.cdr import CdrError

    with domain_view(options) as view:
        kind, announced, arriving = _subscribed(view, words)
        message = view.message(kind, announced)
        for payload in arriving:
            try:
                values = view.decode(payload, message)
            except CdrError as error:
                print(f"WARNING: a message is left out: {listed(error)}", file=sys.stderr)
                continue
            shown: Any = view.shown(values, message, no_arrays=options.no_arrays, is_whole=options.is_whole)
            for part in (options.field or "").split(".") if options.field else ():
                if not isinstance(shown, dict) or part not in shown:
                    raise CommandError(f"{kind} has no field [{listed(options.field)}]")
                shown = shown[part]
            text = (
                _yaml(yaml, shown) if isinstance(shown, (dict, list)) else f"{printable_lines(str(shown))}\n"
            )
            print(f"{text}---", flush=True)
            if options.once:
                break
    return 0


def hz(argv: Sequence[str]) -> int:
    from pipros_tools.graph.measurements import Rates
    from pipros_tools.graph.samples import DEFAULT_WINDOW

    parser = look_parser("hz", "[options] /topic", "Prints the rate at which messages arrive.")
    parser.add_option(
        "-w", "--window", type="int", default=DEFAULT_WINDOW, help="messages that a rate is computed from"
    )
    options, words = parsed(parser, argv, least=1, most=1)
    rates = Rates(words, options.window, say=print)
    with domain_view(options) as view:
        _, _, arriving = _subscribed(view, words, wakes=True)
        last_s = time.monotonic()
        for payload in arriving:
            now_s = time.monotonic()
            if payload is not None:
                rates.add(words[0], now_s)
            if now_s >= last_s + 1:
                last_s = now_s
                if rates.has_new():
                    print(rates.report(), flush=True)
    return 0


def pub(argv: Sequence[str]) -> int:
    parser = look_parser("pub", "[options] /topic type [values]", "Publishes a message.")
    parser.add_option(
        "-r", "--rate", metavar="N", type="float", default=1.0, help="messages per second (default: 1)"
    )
    add_flag(parser, "-1", "--once", help="publish one message, then exit")
    parser.add_option("--qos-reliability", metavar="POLICY", help="reliable (default) or best_effort")
    parser.add_option("--qos-durability", metavar="POLICY", help="volatile (default) or transient_local")
    add_flag(parser, "--no-wait", dest="is_hasty", help="with --once, do not wait for a subscriber")
    options, words = parsed(parser, argv, least=2, most=3)
    if not 0 < options.rate <= 10_000:
        parser.error(f"--rate must be greater than 0 and at most 10000, got {options.rate}")
    with domain_view(options) as view:
        message = view.message(words[1])
        values = _values(words[2:])
        payload = view.encode(values, message)
        shown = view.python_text(view.decode(payload, message), message)
        publisher = view.engine.advertise(full_name(words[0]), words[1], view.hash_of(message), _qos(options))
        is_late = options.once and not options.is_hasty
        while is_late and not _wait_until(lambda: publisher.subscriber_count > 0, 1.0):
            print("Waiting for at least 1 matching subscription(s)...", flush=True)
        print("publisher: beginning loop", flush=True)
        next_s, number = time.monotonic(), 0
        while True:
            number += 1
            publisher.publish(payload)
            print(f"publishing #{number}: {shown}\n", flush=True)
            if options.once:
                time.sleep(_LOOK_S)  # the message is sent by a thread, and again if it was lost
                return 0
            next_s += 1 / options.rate
            time.sleep(max(0.0, next_s - time.monotonic()))


def call(argv: Sequence[str]) -> int:
    from pipros_ros2.interface import EndpointKind

    parser = look_parser("call", "[options] /service type [values]", "Calls a service.")
    parser.add_option(
        "--timeout",
        metavar="S",
        type="float",
        default=10.0,
        help="wait S seconds for the service, and for its reply (default: 10)",
    )
    options, words = parsed(parser, argv, least=2, most=3)
    name = full_name(words[0])
    with domain_view(options) as view:
        service = view.service(words[1])
        request = view.encode(_values(words[2:]), service.request)
        caller = view.engine.caller(name, words[1], "", view.parts(service))
        if not caller.is_available:
            print("waiting for service to become available...", flush=True)
        if not _wait_until(lambda: caller.is_available, options.timeout):
            servers = view.wait_for(name, EndpointKind.SERVER, 0)
            types = ", ".join(sorted({each.type for each in servers}))
            what = (
                f"has the type {types}, not {words[1]}"
                if types and words[1] not in types
                else "is not available"
            )
            raise CommandError(f"service [{name}] {what}")
        shown = view.python_text(view.decode(request, service.request), service.request)
        print(f"requester: making request: {shown}\n", flush=True)
        reply = view.decode(caller.call(request, options.timeout), service.response)
        print(f"response:\n{view.python_text(reply, service.response)}\n")
    return 0


def _subscribed(
    view: DomainView, words: Sequence[str], *, wakes: bool = False
) -> tuple[str, str, Iterator[Any]]:
    """Subscribe to a topic. Return its type, its announced hash, and an iterator over the payloads.

    If `wakes` is true, the iterator also yields None now and then.
    """
    from pipros.basics.errors import NotFound
    from pipros_ros2.interface import TopicQos
    from pipros_ros2.look import ANY_PUBLISHER, topic_of
    from pipros_ros2.qos_choice import requested_qos

    name, given = full_name(words[0]), "".join(words[1:])
    try:
        kind, announced, publishers = topic_of(view, name, 3.0)
    except NotFound as error:
        if not given:
            raise CommandError(f"{error}; give its type to wait for it") from None
        kind, announced, publishers = given, "", []
    if given and kind != given:
        raise CommandError(f"topic [{name}] has the type {kind}, not {given}")
    arriving: queue.Queue[bytes] = queue.Queue(_QUEUED)

    def keep(sample: Sample) -> None:
        try:
            arriving.put_nowait(bytes(sample.payload))
        except queue.Full:
            print("WARNING: messages arrive faster than they are printed; some are left out", file=sys.stderr)

    choices: list[TopicQos] = [each.qos for each in requested_qos(publishers)] or [ANY_PUBLISHER]
    for qos in choices:
        view.engine.subscribe(name, kind, announced, qos, keep)
    return kind, announced, _items(arriving, wakes)


def _items(arriving: queue.Queue[bytes], wakes: bool) -> Iterator[bytes | None]:
    while True:
        try:
            yield arriving.get(timeout=_LOOK_S)
        except queue.Empty:
            if wakes:
                yield None


def _yaml(yaml: Any, value: object) -> str:
    text = yaml.safe_dump(
        value, sort_keys=False, allow_unicode=True, width=sys.maxsize, default_flow_style=False
    )
    return str(text)


def _values(words: Sequence[str]) -> object:
    from pipros.safe.yaml import load

    return {} if not words else load(words[0], "<values>", angles=False) or {}


def _qos(options: Any) -> Any:
    from pipros_ros2.interface import Durability, Reliability, TopicQos

    try:
        reliability = Reliability(options.qos_reliability or "reliable")
        return TopicQos(reliability, Durability(options.qos_durability or "volatile"))
    except ValueError as error:
        raise CommandError(f"unknown QoS policy: {error}") from None


def _wait_until(condition: Callable[[], bool], timeout_s: float) -> bool:
    end_s = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.05)
    return True

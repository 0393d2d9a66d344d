"""`rosmsg-proto`: an empty message as YAML, as shells complete it after `rostopic pub /topic type`."""

from __future__ import annotations

import sys
from collections.abc import Collection, Sequence
from typing import Any

import yaml

from pipros.cli.program import USAGE_ERROR, option_parser, run
from pipros.cli.streams import command
from pipros.errors import PiprosError
from pipros.msg import load_message_class, load_service_class
from pipros.msg.base import Message
from pipros.msg.language.spec import FLOATS, INTEGERS
from pipros.msg.time import TVal
from pipros.workspace.type_catalogue import MESSAGES, SERVICES

SMALL = 4
"""From the first message with more fields or elements on, values without parts are written in one line."""

FLOW_STYLES = {0: False, 1: True}


@command
def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(
        "rosmsg-proto",
        "",
        description="Produces output or a msg or service request, intended for tab completion support.",
    )
    parser.set_usage("usage: rosmsgproto msg/srv [options]")
    add = parser.add_option
    add(
        "-f",
        "--flow_style",
        dest="flow_style",
        type="int",
        metavar="FLOW_STYLE",
        help="if 1 always use brackets, if 0 never use brackets. Default is a heuristic mix.",
    )
    add(
        "-e",
        "--empty-arrays",
        dest="empty_arrays",
        action="store_true",
        default=False,
        help="if true flexible size arrays are not filled with default instance",
    )
    add(
        "-s",
        "--silent",
        dest="silent",
        action="store_true",
        default=False,
        help="if true suppresses all error messages",
    )
    add(
        "-p",
        "--prefix",
        dest="prefix",
        metavar="prefix",
        default="",
        help="prefix to print before each line, can be used for indent",
    )
    add(
        "-H",
        "--no-hyphens",
        dest="no_hyphens",
        action="store_true",
        default=False,
        help="if true output has no outer hyphens",
    )
    add(
        "-x",
        "--exclude-slots",
        dest="exclude",
        metavar="exclude_slots",
        default="",
        help="comma separated list of slot names not to print",
    )
    options, arguments = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    if len(arguments) < 2 or arguments[0] not in ("msg", "srv"):
        sys.stderr.write("Insufficient arguments")
        return USAGE_ERROR

    def body() -> int:
        try:
            message = example(arguments[0], arguments[1])
        except UnknownType as error:
            if options.silent:
                return 0
            sys.stderr.write(str(error))
            return 1
        excluded = options.exclude.split(",")
        text = skeleton(
            message, FLOW_STYLES.get(options.flow_style), excluded, fill_arrays=not options.empty_arrays
        )
        text = "\n".join(options.prefix + line for line in text.splitlines())
        print(text if options.no_hyphens else f'"{text}"')
        return 0

    return run(body)


class UnknownType(PiprosError):
    """The message or service does not exist."""


def example(kind: str, name: str) -> Message:
    """An empty message, or an empty request of a service; a name without a package is looked for in all.

    Raises:
        UnknownType: no package has it.
    """
    interfaces, noun = (MESSAGES, "message") if kind == "msg" else (SERVICES, "service")
    found = interfaces.types_named(name)
    if not found:
        raise UnknownType(f"Unknown {noun} name {name}")
    try:
        if kind == "msg":
            return load_message_class(found[0])()
        request: Message = load_service_class(found[0])._request_class()
    except PiprosError:
        raise UnknownType(f"Unknown {noun} class: {found[0]}") from None
    return request


def skeleton(
    message: Message,
    flow_style: bool | None = None,
    excluded: Collection[str] = (),
    *,
    fill_arrays: bool = True,
) -> str:
    """The fields of a message as YAML.

    Args:
        message: what to show.
        flow_style: with brackets always, never, or (None) for the parts of larger messages.
        excluded: names of fields to leave out, on every level.
        fill_arrays: show one element of arrays that would be empty.
    """
    fields = _Skeleton(frozenset(excluded), fill_arrays).fields(message)

    class Dumper(_Dumper):
        is_mixed = flow_style is None

    text: str = yaml.dump(fields, Dumper=Dumper, default_flow_style=bool(flow_style))
    return text.rstrip("\n")


class _Fields(dict[str, Any]):
    """The fields of one message, in their order."""

    @property
    def is_large(self) -> bool:
        return len(self) > SMALL or any(
            isinstance(part, list) and len(part) > SMALL for part in self.values()
        )


class _Dumper(yaml.SafeDumper):
    """Writes fields in their order, and small parts in one line from the first large message on."""

    is_mixed = True

    def represent_fields(self, fields: _Fields) -> yaml.Node:
        if self.is_mixed and fields.is_large:
            self.default_flow_style = None  # type: ignore[assignment]  # PyYAML's mixed style
        return self.represent_mapping("tag:yaml.org,2002:map", list(fields.items()))

    def ignore_aliases(self, _data: Any) -> bool:
        return True


_Dumper.add_representer(_Fields, _Dumper.represent_fields)


class _Skeleton:
    def __init__(self, excluded: frozenset[str], fill_arrays: bool) -> None:
        self._excluded = excluded
        self._fill_arrays = fill_arrays

    def fields(self, value: Message | TVal) -> _Fields:
        """The fields of a message or a time, with those of its parts."""
        if isinstance(value, TVal):
            named = {"secs": ("int32", value.secs), "nsecs": ("int32", value.nsecs)}
        else:
            kinds = zip(value.__slots__, value._slot_types, strict=True)
            named = {name: (kind, getattr(value, name)) for name, kind in kinds}
        shown = {name: part for name, part in named.items() if name not in self._excluded}
        return _Fields((name, self._plain(kind, part)) for name, (kind, part) in shown.items())

    def _plain(self, kind: str, value: Any) -> Any:
        if isinstance(value, (Message, TVal)):
            return self.fields(value)
        if isinstance(value, (list, tuple)):
            if not value and self._fill_arrays:
                return [self._element(kind.partition("[")[0])]
            return [self._plain(kind.partition("[")[0], element) for element in value]
        return value

    def _element(self, kind: str) -> Any:
        """The element that is shown for an empty array."""
        if kind in INTEGERS or kind in FLOATS:
            return 0
        if kind in ("bool", "string"):
            return False if kind == "bool" else ""
        if kind in ("time", "duration"):
            return self.fields(TVal())
        return self.fields(load_message_class(kind)())

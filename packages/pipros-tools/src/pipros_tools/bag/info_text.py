"""Format summaries of bags: the text and YAML that Noetic's `rosbag info` prints, HTML, and a tree."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from pipros.basics.html_table import html_table
from pipros.basics.printable import listed
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.info import BagInfo, BagTopic

_PLAIN = re.compile(r"[\w/.*~+-]*")


def _printable(info: BagInfo) -> BagInfo:
    """Return `info` with each name and checksum on one line, without control characters."""
    return replace(
        info,
        path=info.path and listed(info.path),
        compressions=[replace(each, name=listed(each.name)) for each in info.compressions],
        types=[(listed(name), listed(md5sum)) for name, md5sum in info.types],
        topics=[replace(each, topic=listed(each.topic), type=listed(each.type)) for each in info.topics],
        left_out=[(listed(name), listed(reason)) for name, reason in info.left_out],
    )


def info_text(info: BagInfo) -> str:
    """Return the output of `rosbag info`."""
    info = _printable(info)
    rows: list[tuple[str, str]] = [] if info.path is None else [("path", info.path)]
    rows.append(("version", info.version))
    if not info.is_indexed:
        rows.append(("size", human_size(info.size)))
    else:
        if info.start is not None and info.end is not None:
            rows.append(("duration", _duration(info.end - info.start)))
            rows.append(("start", f"{_date(info.start)} ({info.start:.2f})"))
            rows.append(("end", f"{_date(info.end)} ({info.end:.2f})"))
        rows.append(("size", human_size(info.size)))
        rows.append(("messages", str(info.messages)))
        rows += _compression_rows(info)
        rows += _column("types", _type_lines(info))
        rows += _column("topics", _topic_lines(info))
    rows += _column("beside", [f"{count} {name}" for name, count in info.beside.items()])
    rows += _column("left out", [f"{name}: {reason}" for name, reason in info.left_out])
    width = max(len(label) for label, _ in rows) + 1
    return "\n".join(f"{label + ':' if label else '':{width}} {text}" for label, text in rows).rstrip()


def info_html(info: BagInfo) -> str:
    """Return a table of the topics, for notebooks."""
    span = "" if info.start is None or info.end is None else f", {info.end - info.start:.1f} s"
    title = f"{info.path or ''} {human_size(info.size)}{span}, {info.messages} messages".strip()
    seconds = (info.end or 0) - (info.start or 0)
    rows = [(each.topic, each.type, str(each.messages), _rate(each, seconds)) for each in info.topics]
    rows += [(name, f"left out: {reason}", "", "") for name, reason in info.left_out]
    return html_table(("topic", "type", "messages", "Hz"), rows, title)


def _rate(topic: BagTopic, seconds: float) -> str:
    """Format the frequency. Return an empty string if it is unknown, or meaningless because of bursts."""
    is_steady = topic.frequency is not None and topic.frequency * seconds < 100 * topic.messages
    return f"{topic.frequency:.4g}" if is_steady else ""


def _column(label: str, lines: Sequence[str]) -> Iterator[tuple[str, str]]:
    for number, line in enumerate(lines):
        yield "" if number else label, line


def _compression_rows(info: BagInfo) -> Iterator[tuple[str, str]]:
    total = info.compression
    parts = []
    for each in info.compressions:
        ratio = ""
        if each.name != "none":
            ratio = (
                f"; {100.0 * each.compressed / each.uncompressed:.2f}%" if each.uncompressed else "; 0.00%"
            )
        parts.append(f"{each.name} [{each.chunks}/{total.chunks} chunks{ratio}]")
    if info.version.startswith("1."):
        parts = []  # the bag has no chunks
    yield "compression", ", ".join(parts) or "none"
    if all(each.name == "none" for each in info.compressions):
        return
    duration = (info.end or 0.0) - (info.start or 0.0)
    sizes = [human_size(total.uncompressed), human_size(total.compressed)]
    width = max(map(len, sizes))
    shown = [f"{size:>{width}}" for size in sizes]
    if duration > 0:
        rates = [human_size(total.uncompressed / duration), human_size(total.compressed / duration)]
        width = max(map(len, rates))
        shown = [f"{size} @ {rate:>{width}}/s" for size, rate in zip(shown, rates, strict=True)]
        shown[1] += f" ({100.0 * total.compressed / (total.uncompressed or 1):.2f}%)"
    yield "uncompressed", shown[0]
    yield "compressed", shown[1]


def _type_lines(info: BagInfo) -> list[str]:
    width = max((len(name) for name, _ in info.types), default=0)
    return [f"{name:{width}} [{md5sum}]" for name, md5sum in info.types]


def _topic_lines(info: BagInfo) -> list[str]:
    topics = info.topics
    frequencies = ["" if each.frequency is None else human_frequency(each.frequency) for each in topics]
    name, count, kind = (
        max((len(text) for text in texts), default=0)
        for texts in (
            [each.topic for each in topics],
            [str(each.messages) for each in topics],
            [each.type for each in topics],
        )
    )
    rate = max(map(len, frequencies), default=0)
    lines = []
    for each, frequency in zip(topics, frequencies, strict=True):
        line = f"{each.topic:{name}}   {each.messages:{count}d} {'msg ' if each.messages == 1 else 'msgs'}"
        line += f" @ {frequency:>{rate}}" if frequency else "   " + " " * rate
        line += f" : {each.type:{kind}}"
        lines.append(line + (f" ({each.connections} connections)" if each.connections > 1 else ""))
    return lines


def info_tree(info: BagInfo) -> dict[str, Any]:
    """Return the values that `rosbag info --yaml` prints, with fractions formatted as strings."""
    info = _printable(info)
    tree: dict[str, Any] = {} if info.path is None else {"path": info.path}
    tree["version"] = info.version
    beside = [{"name": name, "count": count} for name, count in info.beside.items()]
    left_out = [{"name": name, "reason": reason} for name, reason in info.left_out]
    end = {name: each for name, each in (("beside", beside), ("left_out", left_out)) if each}
    if not info.is_indexed:
        return {**tree, "size": info.size, "indexed": False, **end}
    if info.start is not None and info.end is not None:
        tree["duration"] = f"{info.end - info.start:.6f}"
        tree["start"] = f"{info.start:.6f}"
        tree["end"] = f"{info.end:.6f}"
    total = info.compression
    tree |= {"size": info.size, "messages": info.messages, "indexed": True, "compression": total.name}
    if any(each.name != "none" for each in info.compressions):
        tree |= {"uncompressed": total.uncompressed, "compressed": total.compressed}
    tree["types"] = [{"type": name, "md5": md5sum} for name, md5sum in info.types]
    tree["topics"] = [_topic_tree(each) for each in info.topics]
    return tree | end


def _topic_tree(topic: BagTopic) -> dict[str, Any]:
    tree: dict[str, Any] = {"topic": topic.topic, "type": topic.type, "messages": topic.messages}
    if topic.connections > 1:
        tree["connections"] = topic.connections
    if topic.frequency is not None:
        tree["frequency"] = f"{topic.frequency:.4f}"
    return tree


def info_yaml(info: BagInfo) -> str:
    """Return the output of `rosbag info --yaml`."""
    lines = []
    for name, value in info_tree(info).items():
        if not isinstance(value, list):
            lines.append(f"{name}: {value if name == 'path' else _scalar(value)}")
            continue
        lines.append(f"{name}:")
        lines += [f"    {line}" for line in _items(value)]
    return "\n".join(lines) + "\n"


def info_value(info: BagInfo, key: str) -> str:
    """Return the output of `rosbag info --yaml --key`: the value at a path such as `topics[0].messages`.

    Raises:
        BagError: the key does not exist.
    """
    value: Any = info_tree(info)
    for part in key.replace("[", ".[").split("."):
        try:
            if part.startswith("[") and part.endswith("]") and isinstance(value, list):
                value = value[int(part[1:-1])]
            elif isinstance(value, dict):
                value = value[part]
            else:
                raise KeyError(part)
        except (KeyError, IndexError, ValueError):
            raise BagError(f'Error getting key "{key}"') from None
    if isinstance(value, list):
        return "\n".join(_items(value)) + "\n"
    if isinstance(value, dict):
        return "\n".join(f"{name}: {_scalar(each)}" for name, each in value.items()) + "\n"
    if isinstance(value, str) and value.replace(".", "", 1).isdigit():
        return str(float(value))
    return str(value)


def _items(values: Sequence[dict[str, Any]]) -> Iterator[str]:
    for value in values:
        for number, (name, each) in enumerate(value.items()):
            yield f"{'  ' if number else '- '}{name}: {_scalar(each)}"


def _scalar(value: object) -> str:
    """Format a value as YAML, as Noetic does, but quote it if it would otherwise be ambiguous."""
    text = str(value)
    return text if _PLAIN.fullmatch(text) else "'" + text.replace("'", "''") + "'"


def _duration(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.1f}s"
    whole = int(seconds)
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{f'{hours}hr ' if hours else ''}{minutes}:{whole % 60:02d}s ({whole}s)"


def _date(seconds: float) -> str:
    try:
        date = time.strftime("%b %d %Y %H:%M:%S", time.localtime(seconds))
    except (OverflowError, OSError, ValueError):
        return f"{seconds:.2f}"
    return f"{date}.{f'{seconds:.2f}'[-2:]}"


def human_size(size: float) -> str:
    """Format a number of bytes: `1.5 MB`."""
    for unit in ("KB", "MB", "GB", "TB", "PB", "EB", "ZB"):
        size /= 1024.0
        if size < 1024:
            return f"{size:.1f} {unit}"
    return "-"


def human_frequency(frequency: float) -> str:
    """Format a frequency in Hz: `1.5 kHz`."""
    for unit in ("Hz", "kHz", "MHz", "GHz"):
        if frequency < 1000:
            return f"{frequency:.1f} {unit}"
        frequency /= 1000.0
    return f"{frequency:.1f} THz"

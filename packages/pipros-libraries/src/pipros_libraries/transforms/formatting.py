"""Format the frame tree as text, YAML, Graphviz DOT or HTML, and poses as text.

Except for HTML, the formats are the same as in tf2, because tools parse them.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from math import degrees

from pipros.basics.html_table import html_table
from pipros.msg.time import NS_PER_S
from pipros_libraries.transforms.history import FrameHistory, MovingFrame
from pipros_libraries.transforms.pose import Pose, roll_pitch_yaw

Frames = Mapping[str, FrameHistory | None]

_PLAIN_KEY = re.compile(r"(?!(?:y|n|yes|no|on|off|true|false|null)$)[A-Za-z_][\w./-]*", re.IGNORECASE)
_PLAIN_TEXT = re.compile(r"[^'\x00-\x1f\x7f-\x9f]*")


def frames_as_string(frames: Frames, limit_characters: int | None = None) -> str:
    """Return one line per frame, naming the frame and its parent. Roots are omitted.

    An ellipsis replaces the text beyond the limit.
    """
    lines = []
    characters = 0
    for name, frame in frames.items():
        if frame is not None:
            parent = frame.latest()[1] or "NO_PARENT"
            lines.append(f"Frame {name} exists with parent {parent}.\n")
            characters += len(lines[-1])
            if limit_characters is not None and characters > limit_characters:
                return "".join(lines)[:limit_characters] + "…\n"
    return "".join(lines)


def frames_as_yaml(frames: Frames) -> str:
    """Return a YAML mapping of frames to their parent, publishing node, rate in Hz, and times in seconds."""
    return (
        "{}"
        if not frames
        else "".join(
            f"{name if _PLAIN_KEY.fullmatch(name) else _in_yaml(name)}: \n"
            f"  parent: {_in_yaml(parent)}\n  broadcaster: {_in_yaml(sender)}\n  rate: {rate:.3f}\n"
            f"  most_recent_transform: {newest:.3f}\n  oldest_transform: {oldest:.3f}\n"
            f"  buffer_length: {newest - oldest:.3f}\n"
            for name, parent, sender, rate, newest, oldest in _rows(frames)
        )
    )


def _in_yaml(text: str) -> str:
    """Return the text in single quotes, as in tf2, or in double quotes, if it cannot be."""
    return f"'{text}'" if _PLAIN_TEXT.fullmatch(text) else json.dumps(text, ensure_ascii=False)


def frames_as_dot(frames: Frames, now: float | None = None) -> str:
    """Return the frame tree in the DOT language.

    If `now` (in seconds) is given, include the transforms' ages.
    """
    if not frames:
        return 'digraph G {\n"no tf data recieved"}'
    lines = []
    for *names, rate, newest, oldest in _rows(frames):
        name, parent, sender = map(_in_dot, names)
        age = "" if now is None else f"( {now - newest:.3f} sec old)"
        lines.append(
            f'"{parent}" -> "{name}"[label="Broadcaster: {sender}\\nAverage rate: {rate:.3f} Hz\\n'
            f'Most recent transform: {newest:.3f} {age}\\nBuffer length: {newest - oldest:.3f} sec\\n"];\n'
        )
    recorded = "" if now is None else f'"Recorded at time: {now:.3f}"[ shape=plaintext ] ;\n '
    legend = (
        "edge [style=invis];\n"
        f' subgraph cluster_legend {{ style=bold; color=black; label ="view_frames Result";\n{recorded}}}->'
    )
    for name, frame in frames.items():
        # As in tf2, a root has a legend only if `now` is given, but a frame whose transforms were cleared
        # always has one.
        if (now is not None) if frame is None else (frame.latest()[1] is None):
            lines.append(f'{legend}"{_in_dot(name)}";\n')
    return f"digraph G {{\n{''.join(lines)}}}"


def _in_dot(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')


def frames_as_html(frames: Frames) -> str:
    """Return the frame tree for notebooks: a table with indented names."""
    rows = {row[0]: row for row in _rows(frames)}
    below: dict[str, list[str]] = {}
    for name, parent, *_ in rows.values():
        below.setdefault(parent, []).append(name)
    shown: dict[str, list[str]] = {}
    waiting = [(name, 0) for name in sorted({*frames, *below}, reverse=True) if name not in rows]
    while waiting:
        name, depth = waiting.pop()
        row = rows.get(name)
        facts = ["", "", ""] if row is None else [row[2], *_rate_and_time(frames[name], *row[3:])]
        if name not in shown:
            shown[name] = ["\N{NO-BREAK SPACE}" * 4 * depth + name, *facts]
            waiting += [(each, depth + 1) for each in sorted(below.get(name, ()), reverse=True)]
    return html_table(("frame", "published by", "Hz", "latest (s)"), shown.values(), f"{len(shown)} frames")


def _rate_and_time(frame: FrameHistory | None, rate: float, newest: float, oldest: float) -> tuple[str, str]:
    """Return the rate and the latest time as strings.

    The rate is empty for a static transform and for a single transform. The time of a static transform is
    `static`.
    """
    if not isinstance(frame, MovingFrame):
        return "", "static"
    return f"{rate:.1f}" if newest > oldest else "", f"{newest:.3f}"


def edges(frames: Frames) -> list[tuple[str, str, str, float]]:
    """Return the parent, child, publishing node and rate in Hz for each frame with known transforms."""
    return [(parent, name, sender, rate) for name, parent, sender, rate, *_ in _rows(frames)]


def _rows(frames: Frames) -> Iterator[tuple[str, str, str, float, float, float]]:
    """Yield a row for each frame with a parent.

    A row contains the name, parent, publishing node, rate in Hz, and latest and oldest time in seconds.
    """
    for name, frame in frames.items():
        if frame is None:
            continue
        stamp, parent = frame.latest()
        if parent is None:
            continue
        newest, oldest = stamp / NS_PER_S, frame.oldest_stamp() / NS_PER_S
        count = len(frame.stamps) if isinstance(frame, MovingFrame) else 1
        yield name, parent, frame.authority, count / max(newest - oldest, 0.0001), newest, oldest


def pose_as_text(pose: Pose, digits: int = 3) -> str:
    """Return the four lines that `tf_echo` prints for a pose."""

    def joined(numbers: Sequence[float]) -> str:
        return ", ".join(f"{number:.{digits}f}" for number in numbers)

    angles = roll_pitch_yaw(pose)
    return (
        f"- Translation: [{joined(pose[:3])}]\n"
        f"- Rotation: in Quaternion [{joined(pose[3:])}]\n"
        f"            in RPY (radian) [{joined(angles)}]\n"
        f"            in RPY (degree) [{joined([degrees(angle) for angle in angles])}]"
    )

"""Nodes for scans, images and clouds get messages whose fields contradict each other, and keep working.

All nodelets share one process, whose memory is measured.
"""

import copy
import random
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

from pipros.msg import load_message_class
from pipros.msg.language.spec import INTEGERS, OCTETS
from pipros.msg.time import Time
from pipros.packages.nodelets import shipped_nodelets
from tests.support.launch_recipes import MANAGER, RECIPES, TWIST, launch_file, moment, write_files
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

NODELETS = [name for name in shipped_nodelets() if name in RECIPES]
"""Those that answer to messages of the bag; tests.security has the velocity multiplexer and the bumpers."""
ROUNDS = 40
STRANGE_PER_ROUND = 10
GROWTH_BYTES = 200_000_000
FLOATS = (0.0, -1.0, 1e-30, 1e30, 3.4e38, float("inf"), -float("inf"), float("nan"))
TEXTS = ("", "mono8", "mono16", "bgr8", "rgba8", "bayer_gbrg8", "yuv422", "16UC1", "32FC1", "64FC3", "8UC9",
         "plumb_bob", "equidistant", "laser", "camera", "x", "y", "z", "rgb", "\x00\n")  # fmt: skip


def strange(message: Any, numbers: random.Random) -> Any:
    """Return a copy of a message with up to three fields replaced; the timestamp of the header stays."""
    changed = copy.deepcopy(message)
    for _ in range(numbers.randint(1, 3)):
        _change(changed, numbers)
    return changed


def _change(message: Any, numbers: random.Random) -> None:
    places = [
        (slot, kind)
        for slot, kind in zip(message.__slots__, message._slot_types, strict=True)
        if kind != "time"
    ]
    slot, kind = numbers.choice(places)
    value, (base, bracket, size) = getattr(message, slot), kind.rstrip("]").partition("[")
    if not bracket and hasattr(value, "_slot_types"):
        _change(value, numbers)
    elif not bracket:
        setattr(message, slot, _single(base, numbers))
    elif len(value) and hasattr(value[0], "_slot_types") and numbers.random() < 0.8:
        _change(numbers.choice(value), numbers)
    elif base in OCTETS:
        length = int(size) if size else numbers.choice((0, 1, len(value) // 2, len(value), len(value) + 7))
        setattr(message, slot, numbers.randbytes(length))
    elif size:
        setattr(message, slot, [_single(base, numbers) if numbers.random() < 0.3 else each for each in value])
    else:
        kept = list(value)[: numbers.choice((0, 1, len(value), len(value)))]
        if kept and not hasattr(kept[0], "_slot_types"):
            for _ in range(numbers.choice((0, 1, len(kept)))):
                kept[numbers.randrange(len(kept))] = _single(base, numbers)
        setattr(message, slot, kept * numbers.choice((1, 1, 3)))


def _single(base: str, numbers: random.Random) -> Any:
    if base in INTEGERS:
        bits = 8 * int(re.sub(r"\D", "", base) or 8) // 8
        low, high = (0, 2**bits - 1) if base.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        return numbers.choice((low, 0, 1, 2, min(high, 65536), high, numbers.randint(low, high)))
    if base.startswith("float"):
        return numbers.choice(FLOATS)
    return numbers.choice(TEXTS) if base == "string" else numbers.random() < 0.5


def huge(message: Any) -> Any:
    """Return a message that announces as many values as possible, and contains none."""
    changed = copy.deepcopy(message)
    if hasattr(changed, "point_step"):
        changed.width = changed.height = 2**32 - 1
        changed.point_step, changed.data = 0, b""
    elif hasattr(changed, "encoding"):
        changed.width, changed.height, changed.step, changed.data = 2**29, 0, 2**32 - 1, b""
    elif hasattr(changed, "K"):
        changed.width = changed.height = changed.roi.width = changed.roi.height = 2**32 - 1
        changed.P = [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1, 0]
    return changed


def stamped(topic: str, message: Any, second: int) -> Any:
    """Return a message of the bag with another timestamp, also in the messages that it contains."""
    if topic == "/tf":
        for each in message.transforms:
            each.header.stamp = Time(second, 0)
    elif hasattr(message, "header"):
        message.header.stamp = Time(second, 0)
    return message


def memory_bytes(process: int, field: str) -> int:
    """Return `VmRSS` or `VmHWM` of a process."""
    status = Path(f"/proc/{process}/status").read_text()
    return 1024 * int(re.findall(rf"{field}:\s+(\d+) kB", status)[0])


def test_nodes_for_sensors_survive_strange_messages(ros: RosSystem, tmp_path: Path) -> None:
    write_files(tmp_path)
    text, outputs = launch_file("fuzz", [MANAGER, *NODELETS], tmp_path)
    (tmp_path / "fuzz.launch").write_text(text)
    launch = ros.pipros.start(
        "roslaunch", "-p", str(ros.port), tmp_path / "fuzz.launch", PIPROS_NODELETS="ours"
    )
    launch.wait_for(r"started core service \[/rosout\]")
    numbers = random.Random(1)  # noqa: S311
    with ros.node("sensors") as node:
        inboxes = {each.topic: Inbox() for each in outputs[1:]}
        for each in outputs[1:]:
            ros.wait_for_publisher(each.topic, 120)
            node.subscribe(each.topic, load_message_class(each.type), inboxes[each.topic])
        publishers = {
            topic: node.advertise(topic, type(message), queue_size=STRANGE_PER_ROUND)
            for topic, message in moment(0)
        }
        seconds = iter(range(5000, 10**6))
        good = Good(inboxes, publishers)
        good.wait_for_answers(seconds, lambda: launch.output)
        manager = pid_of(ros, "/fuzz/manager")
        before = memory_bytes(manager, "VmRSS")
        for _ in range(STRANGE_PER_ROUND):
            for topic, message in moment(0):
                publishers[topic].publish(huge(stamped(topic, message, 4000)))
        good.wait_for_answers(seconds, lambda: launch.output)
        for _ in range(ROUNDS):
            for _ in range(STRANGE_PER_ROUND):
                second = 1000 + numbers.randrange(1000)
                for topic, message in moment(0):
                    sent = stamped(topic, message, second)
                    if topic != "/tf":
                        publishers[topic].publish(strange(sent, numbers))
            good.wait_for_answers(seconds, lambda: launch.output)
        growth = memory_bytes(manager, "VmHWM") - before
    assert growth < GROWTH_BYTES, f"{growth} bytes"
    launch.press_ctrl_c(code=0)
    assert "process has died" not in launch.output
    assert "Traceback" not in launch.output


class Good:
    """Sends good messages until all nodes have answered them."""

    def __init__(self, inboxes: Mapping[str, Inbox], publishers: Mapping[str, Any]) -> None:
        self._inboxes, self._publishers = inboxes, publishers

    def wait_for_answers(self, seconds: Any, log: Any) -> None:
        for inbox in self._inboxes.values():
            inbox.messages.clear()
        first = next(seconds)

        def silent() -> list[str]:
            second = next(seconds)
            for topic, message in moment(0):
                self._publishers[topic].publish(stamped(topic, message, second))
            return [
                topic for topic, inbox in self._inboxes.items() if not any(map(is_answer, inbox.messages))
            ]

        def is_answer(message: Any) -> bool:
            return message._type == TWIST or message.header.stamp.secs >= first

        wait_until(lambda: not silent(), 120, lambda: f"{silent()} {log()}")


def pid_of(ros: RosSystem, name: str) -> int:
    """Return the process of a node."""
    with ServerProxy(ros.master_uri) as opened:
        master: Any = opened
        with ServerProxy(master.lookupNode("/a_test", name)[2]) as api:
            answer: Any = api.getPid("/a_test")
            return int(answer[2])

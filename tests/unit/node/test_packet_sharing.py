"""When messages follow each other closely enough to share packets."""

from pipros.node.packet_sharing import CLOSE_S, LATE, RUN_LENGTH, SILENCE_S, BurstDetector

CLOSE, FAR = CLOSE_S / 2, CLOSE_S * 2


class Messages:
    """Sends by a clock of its own; keeps the numbers of the messages that changed the pace."""

    def __init__(self) -> None:
        self.pace = BurstDetector()
        self.now_s = 100.0
        self.sent = 0
        self.changes: list[int] = []

    def send(self, count: int, gap_s: float) -> None:
        for _ in range(count):
            self.now_s += gap_s
            self.sent += 1
            if self.pace.note(self.now_s):
                self.changes.append(self.sent)


def test_close_messages_make_a_dense_run() -> None:
    messages = Messages()
    messages.send(1 + RUN_LENGTH - 1, CLOSE)
    assert not messages.pace.in_burst
    messages.send(1000, CLOSE)
    assert messages.pace.in_burst
    assert messages.changes == [1 + RUN_LENGTH]


def test_messages_apart_make_none() -> None:
    messages = Messages()
    messages.send(1000, FAR)
    assert not messages.pace.in_burst
    assert not messages.changes


def test_short_bursts_make_none() -> None:
    messages = Messages()
    for _ in range(100):
        messages.send(LATE - 1, CLOSE)
        messages.send(1, FAR)
    assert not messages.changes


def test_a_late_message_does_not_end_a_run_but_a_few_in_a_row_do() -> None:
    messages = Messages()
    messages.send(1 + RUN_LENGTH, CLOSE)
    for _ in range(10):
        messages.send(1, FAR)
        messages.send(LATE, CLOSE)
    assert messages.pace.in_burst
    messages.send(RUN_LENGTH // LATE - 1, FAR)
    assert messages.pace.in_burst
    messages.send(1, FAR)
    assert not messages.pace.in_burst
    assert len(messages.changes) == 2


def test_silence_ends_a_run_once() -> None:
    messages = Messages()
    messages.send(1 + RUN_LENGTH, CLOSE)
    assert not messages.pace.end_if_idle(messages.now_s + SILENCE_S / 2)
    assert messages.pace.end_if_idle(messages.now_s + SILENCE_S)
    assert not messages.pace.in_burst
    assert not messages.pace.end_if_idle(messages.now_s + SILENCE_S)
    messages.send(RUN_LENGTH, CLOSE)
    assert messages.pace.in_burst, "the next run begins anew"

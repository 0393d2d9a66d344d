"""The limits of the server for assistants."""

from typing import NamedTuple

_KIB = 1024
_MIB = 1024 * _KIB


class AssistantLimits(NamedTuple):
    """The limits of the server for assistants: `limits.of(AssistantLimits)` for a `Limits`.

    Attributes:
        assistant_answer_bytes: the text of an answer.
        assistant_picture_bytes: a picture of an answer.
        assistant_picture_pixels: an image of the robot that is decoded for a picture.
        assistant_sample_bytes: the messages that one call receives or reads.
        assistant_request_bytes: a request over HTTP.
        assistant_sessions: sessions over HTTP, and requests that are answered at a time.
        assistant_call_s: the time of a call.
        assistant_query_s: the time of an SQL query; also its processor time.
        assistant_query_bytes: the memory of the process of an SQL query, and the files that it writes.
        assistant_approvals: acts that wait for a human at a time.
        assistant_approval_s: how long each waits.
        assistant_act_characters: the values of an act, which the human sees whole.
        assistant_runs: launch files and recordings that run at a time.
        assistant_record_bytes: a recording.
    """

    assistant_answer_bytes: int = 31 * _KIB
    assistant_picture_bytes: int = 250 * _KIB
    assistant_picture_pixels: int = 64 * _MIB
    assistant_sample_bytes: int = 64 * _MIB
    assistant_request_bytes: int = 1 * _MIB
    assistant_sessions: int = 16
    assistant_call_s: float = 60.0
    assistant_query_s: float = 30.0
    assistant_query_bytes: int = 4096 * _MIB
    assistant_approvals: int = 4
    assistant_approval_s: float = 45.0
    assistant_act_characters: int = 4_000
    assistant_runs: int = 4
    assistant_record_bytes: int = 1024 * _MIB

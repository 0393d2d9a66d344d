"""The limits of the server for assistants."""

from typing import NamedTuple

_KIB = 1024
_MIB = 1024 * _KIB


class AssistantLimits(NamedTuple):
    """The limits of the server for assistants.

    Get them with `limits.of(AssistantLimits)`, where `limits` is a `Limits`. Each limit is a maximum.

    Attributes:
        assistant_answer_bytes: size of an answer's text.
        assistant_picture_bytes: size of a picture in an answer.
        assistant_picture_pixels: number of pixels in an image from the robot that is decoded to create a
            picture.
        assistant_sample_bytes: total size of the messages that one call receives. A call that reads a bag may
            read four times as much.
        assistant_request_bytes: size of an HTTP request, or of a line over standard input.
        assistant_sessions: number of HTTP sessions; four times as many connections are accepted.
        assistant_call_s: duration of a call.
        assistant_query_s: elapsed time of an SQL query, and its processor time.
        assistant_query_bytes: memory of an SQL query's process, and size of each file that it writes.
        assistant_approvals: number of acts that await approval at the same time.
        assistant_approval_s: time for which an act awaits approval.
        assistant_act_characters: length of an act's values, which are shown to the human in full.
        assistant_runs: number of launch files and recordings that run at the same time.
        assistant_record_bytes: size of a recording.
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

"""Servers of interactive markers of both sides send the same messages."""

from __future__ import annotations

from pathlib import Path

from tests.support.ros import RosSystem

PROGRAM = Path(__file__).parent / "programs" / "serve_markers.py"


def test_a_server_sends_the_same_messages(plain_ros: RosSystem) -> None:
    plain_ros.serve_master()

    genuine = plain_ros.genuine.run("python3", PROGRAM, timeout_s=60)
    ours = plain_ros.pipros.run("python3", PROGRAM, timeout_s=60)

    assert genuine.returncode == 0, genuine.output
    assert len(genuine.stdout) > 3000
    assert ours.stdout == genuine.stdout, ours.output

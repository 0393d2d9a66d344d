"""`rosrun actionlib_tools axserver.py /action type`: execute goals by hand from a terminal."""

from __future__ import annotations

import sys
from threading import Lock
from typing import Any

import rospy
from actionlib import SimpleActionServer
from actionlib_tools.dynamic_action import DynamicAction
from actionlib_tools.prompt import Prompt, indented, read_message

USAGE = """Usage: axserver.py /action_name action_type

On a terminal: show each goal and read the commands below. Otherwise: every goal succeeds with the result read
as YAML from standard input (empty for the default result)."""
COMMANDS = "Commands: feedback YAML, succeed YAML, abort YAML, preempt YAML, quit"


class Server:
    """Action server whose user decides how goals end.

    If `answer` is given, all goals succeed with this result instead.
    """

    def __init__(self, name: str, action: DynamicAction, answer: Any = None) -> None:
        self.action = action
        self._answer = answer
        self._lock = Lock()
        self._server = SimpleActionServer(name, action.action, auto_start=False)
        self._server.register_goal_callback(self._on_goal)
        self._server.register_preempt_callback(self._on_cancel)
        self._server.start()

    def _on_goal(self) -> None:
        with self._lock:
            goal = self._server.accept_new_goal()
        if goal is None:
            return
        print(f"goal:\n{indented(goal)}", flush=True)
        if self._answer is not None:
            self._server.set_succeeded(self._answer)

    def _on_cancel(self) -> None:
        print("The client requested cancellation of the goal.", flush=True)

    def do(self, word: str, text: str) -> None:
        """Execute a user command.

        Raises:
            ValueError: the command is unknown, no goal is active, or the text is not a valid message.
        """
        endings = {
            "succeed": self._server.set_succeeded,
            "abort": self._server.set_aborted,
            "preempt": self._server.set_preempted,
        }
        if word not in endings and word != "feedback":
            raise ValueError(COMMANDS)
        if not self._server.is_active():
            raise ValueError("no goal is active")
        wanted = self.action.feedback if word == "feedback" else self.action.result
        message = read_message(wanted, text)
        if word == "feedback":
            self._server.publish_feedback(message)
        else:
            endings[word](message)


def main() -> int:
    """Serve until the node is shut down or the user quits. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) != 2:
        print(USAGE)
        return 0 if arguments[:1] in (["-h"], ["--help"]) else 2
    name, action_type = arguments
    if not action_type.endswith("Action"):
        action_type += "Action"
    try:
        return _serve(name, action_type)
    except ValueError as error:
        print(f"axserver.py: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


def _serve(name: str, action_type: str) -> int:
    is_terminal = sys.stdin.isatty()
    text = "" if is_terminal else sys.stdin.read()  # read before rospy installs its Ctrl-C handler
    rospy.init_node("axserver", anonymous=True, disable_signals=is_terminal)
    action = DynamicAction(action_type)
    server = Server(name, action, None if is_terminal else read_message(action.result, text))
    if is_terminal:
        print(COMMANDS)
        Prompt("axserver> ").run(server.do)
    else:
        rospy.spin()
    return 0


if __name__ == "__main__":
    sys.exit(main())

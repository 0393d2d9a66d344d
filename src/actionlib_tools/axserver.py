"""`rosrun actionlib_tools axserver.py /action type`: answers goals from a terminal."""

from __future__ import annotations

import sys
from threading import Lock
from typing import Any

import rospy
from actionlib import SimpleActionServer
from actionlib_tools.dynamic_action import DynamicAction
from actionlib_tools.library import to_yaml, yaml_msg_str
from actionlib_tools.prompt import Prompt

USAGE = """Usage: axserver.py /action_name action_type

On a terminal: shows each goal, and takes the commands below. Otherwise: every goal succeeds, with the result
that the standard input gives as YAML (nothing for the default)."""
COMMANDS = "Commands: feedback YAML, succeed YAML, abort YAML, preempt YAML, quit"


class Server:
    """One action whose goals are answered by hand, or all with one result."""

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
        print("goal:\n" + "\n".join(f"  {line}" for line in to_yaml(goal).split("\n")), flush=True)
        if self._answer is not None:
            self._server.set_succeeded(self._answer)

    def _on_cancel(self) -> None:
        print("The client asks to end the goal.", flush=True)

    def do(self, word: str, text: str) -> None:
        """Carries out a command of the user.

        Raises:
            ValueError: an unknown command, no goal, or a message of another type.
        """
        endings = {
            "succeed": self._server.set_succeeded,
            "abort": self._server.set_aborted,
            "preempt": self._server.set_preempted,
        }
        if word not in endings and word != "feedback":
            raise ValueError(COMMANDS)
        if not self._server.is_active():
            raise ValueError("there is no active goal")
        wanted = self.action.feedback if word == "feedback" else self.action.result
        message = read_message(wanted, text)
        if word == "feedback":
            self._server.publish_feedback(message)
        else:
            endings[word](message)


def read_message(wanted: Any, text: str) -> Any:
    """A message from YAML.

    Raises:
        ValueError: it is not one of this type.
    """
    try:
        message = yaml_msg_str(wanted, text)
        message._check_types()
    except Exception as error:  # of messages: genpy's and YAML's own
        raise ValueError(f"this is not a {wanted._type}: {error}") from None
    return message


def main() -> int:
    """Serves until the node or the input ends. Returns the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) != 2:
        print(USAGE)
        return 0 if arguments[:1] in (["-h"], ["--help"]) else 2
    name, action_type = arguments
    if not action_type.endswith("Action"):
        action_type += "Action"
    is_terminal = sys.stdin.isatty()
    try:
        answer = "" if is_terminal else sys.stdin.read()  # before rospy handles Ctrl-C
        rospy.init_node("axserver", anonymous=True, disable_signals=is_terminal)
        action = DynamicAction(action_type)
        if not is_terminal:
            server = Server(name, action, read_message(action.result, answer))
            rospy.spin()
            return 0
        server = Server(name, action)
        print(COMMANDS)
        prompt = Prompt("axserver> ")
        while (line := prompt.read()) is not None:
            word, _, text = line.partition(" ")
            if word == "quit":
                return 0
            try:
                server.do(word, text)
            except ValueError as error:
                print(error)
    except ValueError as error:
        print(f"axserver.py: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""`rosrun actionlib_tools axclient.py /action [type]`: send goals from a terminal and show their progress."""

from __future__ import annotations

import sys
from functools import partial
from threading import Event, Lock
from typing import Any

import rospy
import rostopic
from actionlib import SimpleActionClient, TerminalState
from actionlib_tools.dynamic_action import DynamicAction
from actionlib_tools.edit import edited
from actionlib_tools.library import to_yaml
from actionlib_tools.prompt import Prompt, indented, read_message
from pipros.basics.printable import listed

USAGE = """Usage: axclient.py /action_name [action_type]

On a terminal: show the goal and read the commands below. Otherwise: read the goal as YAML from standard input
(empty for the default goal), send it, print feedback and result, and exit with 0 if the goal succeeded.
Ctrl-C cancels the goal."""
COMMANDS = """Commands: edit (the goal, in $EDITOR), set YAML, send, cancel, show, quit"""
_SLICE_S = 0.1


def type_of_action(name: str) -> str:
    """Return a running server's action type, derived from the type of its goal topic.

    Raises:
        ValueError: no server is running, or the topic's type is not an action goal type.
    """
    found = rostopic.get_topic_type(rospy.resolve_name(f"{name}/goal"))[0]
    if found is None:
        raise ValueError(
            f"unable to retrieve the topic type for goal topic '{name}/goal'. Is the action server for "
            f"'{name}' running?"
        )
    if not found.endswith("ActionGoal"):
        raise ValueError(f"topic '{name}/goal' is not an action goal topic: its type is {found}")
    return str(found[: -len("Goal")])


class Client:
    """Client of one action. It prints feedback and results."""

    def __init__(self, name: str, action: DynamicAction) -> None:
        self.action = action
        self.goal = action.goal()
        self._client = SimpleActionClient(name, action.action)
        self._ended = Event()
        self._ended.set()
        self._printing = Lock()

    def wait_for_server(self) -> bool:
        """Wait indefinitely for the server. Return False if the node is shut down first."""
        if not self._client.wait_for_server(rospy.Duration(2)):
            print("Waiting for the action server …", file=sys.stderr)
            return self._client.wait_for_server()
        return True

    def set_goal(self, text: str) -> None:
        """Set the goal from YAML.

        Raises:
            ValueError: the text is not a valid goal for this action.
        """
        self.goal = read_message(self.action.goal, text)

    def send(self) -> None:
        """Send the goal. Does not wait for the result."""
        self._ended.clear()
        self._client.send_goal(self.goal, self._on_end, self._on_active, self._on_feedback)

    def cancel(self) -> None:
        """Request cancellation of the goal, unless it has ended."""
        if not self._ended.is_set():
            self._client.cancel_goal()

    def wait(self) -> int:
        """Wait until the goal has ended. Return its status, or LOST if the node is shut down first."""
        while not self._ended.wait(_SLICE_S):
            if rospy.is_shutdown():
                return TerminalState.LOST
        return self._client.get_state()

    def _on_active(self) -> None:
        print("The goal is active.", flush=True)

    def _on_feedback(self, feedback: Any) -> None:
        with self._printing:  # drop feedback that arrives after the result was printed
            if not self._ended.is_set():
                print(f"feedback:\n{indented(feedback)}", flush=True)

    def _on_end(self, status: int, result: Any) -> None:
        text = self._client.get_goal_status_text()
        with self._printing:
            print(f"result:\n{indented(result)}" if result is not None else "result: none")
            print(f"{TerminalState.to_string(status)}{f': {listed(text)}' if text else ''}", flush=True)
            self._ended.set()


def main() -> int:
    """Send one goal from standard input, or run the prompt on a terminal. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) not in (1, 2) or arguments[0] in ("-h", "--help"):
        print(USAGE)
        return 0 if arguments[:1] in (["-h"], ["--help"]) else 2
    try:
        return _run(*arguments)
    except ValueError as error:
        print(f"axclient.py: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    finally:
        rospy.signal_shutdown("axclient ends")


def _run(name: str, action_type: str | None = None) -> int:
    is_terminal = sys.stdin.isatty()
    goal = "" if is_terminal else sys.stdin.read()  # The node starts only after the input has arrived.
    # On a terminal, the first Ctrl-C cancels the goal instead of shutting down the node.
    rospy.init_node("axclient", anonymous=True, disable_signals=True)
    if action_type is None:
        action_type = type_of_action(name)
    if not action_type.endswith("Action"):
        raise ValueError(f"the action type '{action_type}' doesn't end with the 'Action' suffix")
    client = Client(name, DynamicAction(action_type))
    if not client.wait_for_server():
        return 1
    if not is_terminal:
        client.set_goal(goal)
        return 0 if _send(client) == TerminalState.SUCCEEDED else 1
    print(f"{client.action.goal._type}:\n{indented(client.goal)}\n{COMMANDS}")
    Prompt("axclient> ").run(partial(_do, client))
    return 0


def _send(client: Client, notice: str = "") -> int:
    """Send the goal and return its status; Ctrl-C prints `notice` and cancels the goal."""
    client.send()
    try:
        return client.wait()
    except KeyboardInterrupt:
        print(notice, end="", flush=True)
        client.cancel()
        return client.wait()


def _do(client: Client, word: str, rest: str) -> None:
    """Execute a user command. Raises ValueError if the new goal is invalid, or the editor fails."""
    if word == "send":
        _send(client, "Cancelling the goal …\n")
    elif word == "cancel":
        client.cancel()
    elif word in ("edit", "set", "show", ""):
        if word == "edit":
            client.set_goal(edited(to_yaml(client.goal)))
        elif word == "set":
            client.set_goal(rest)
        print(indented(client.goal))
    else:
        print(COMMANDS)


if __name__ == "__main__":
    sys.exit(main())

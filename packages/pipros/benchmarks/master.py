#!/usr/bin/env python3
"""Speed of the master: pipros and genuine rosmaster, in one run.

    script/bench master [--only params,dictionary] [--crowd 1000]

Each master is called by its own client: the genuine master by `rosgraph.Master` in genuine ROS's Python, and
pipros by `pipros.net.master_client.MasterClient`. They alternate, and the best of three rounds counts, so
that other load affects both alike. If genuine ROS is not installed, only pipros is measured.
"""

import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

from table import Row, free_port, heed_interrupts, write_json

GENUINE_PYTHON = "/usr/bin/python3"
START_UPS = 3
SOURCES = os.path.join(os.path.abspath(os.path.join(__file__, "..", "..", "..", "..")), "build", "src")


# ---- clients: run in their own processes, in the Python of their implementation


class GenuineClient:
    def __init__(self, uri, name="/bench"):
        import rosgraph

        self.call = rosgraph.Master(name, master_uri=uri)

    def __getattr__(self, name):
        return getattr(self.call, name)


class PiprosClient:
    def __init__(self, uri, name="/bench"):
        from pipros.net.master_client import MasterClient

        client = MasterClient(uri, name)
        self.getParam, self.setParam, self.hasParam = client.get_param, client.set_param, client.has_param
        self.registerPublisher, self.getUri = client.register_publisher, client.get_uri
        self.registerSubscriber, self.unregisterPublisher = (
            client.register_subscriber,
            client.unregister_publisher,
        )


def rate(function, count):
    function()
    began = time.perf_counter()
    for _ in range(count):
        function()
    return count / (time.perf_counter() - began)


def params(make, _uri):
    client = make()
    client.setParam("/bench/key", 42)
    return {
        "getParam calls/s": rate(lambda: client.getParam("/bench/key"), 3000),
        "setParam calls/s": rate(lambda: client.setParam("/bench/key", 42), 3000),
        "hasParam calls/s": rate(lambda: client.hasParam("/bench/key"), 3000),
    }


def dictionary(make, _uri):
    client = make()
    value = {f"group_{i}": {f"key_{j}": j * 1.5 if j % 2 else j for j in range(10)} for i in range(100)}
    return {
        "setParam of 1,000 nested keys, ms": 1e3 / rate(lambda: client.setParam("/bench/big", value), 50),
        "getParam of 1,000 nested keys, ms": 1e3 / rate(lambda: client.getParam("/bench/big"), 50),
    }


def registration(make, _uri):
    client = make()
    topics = iter(range(10**9))
    registered = rate(
        lambda: client.registerPublisher(f"/bench/t{next(topics)}", "std_msgs/String", "http://127.0.0.1:9/"),
        1500,
    )
    return {"registration, ms": 1e3 / registered}


def together(make, _uri):
    def work():
        client = make()
        for _ in range(200):
            client.hasParam("/bench/key")

    threads = [threading.Thread(target=work) for _ in range(20)]
    began = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return {"20 clients at once, calls/s": 20 * 200 / (time.perf_counter() - began)}


CLIENTS = {"genuine": GenuineClient, "pipros": PiprosClient}
WORKLOADS = {"params": params, "dictionary": dictionary, "registration": registration, "together": together}


# ---- the crowd: a thousand nodes, which become publishers one after another


def crowd_nodes():
    """Serve the APIs of a crowd of nodes, whose URIs differ only by path. Print the port, and serve until
    killed.
    """
    import asyncio

    from pipros.basics.limits import Limits
    from pipros.net.rpc_server import RpcServer

    async def serve():
        methods = {"publisherUpdate": lambda *_: [1, "", 0], "getPid": lambda _: [1, "", 1]}
        server = RpcServer(methods, limits=Limits(rpc_connections=5000, rpc_connections_per_peer=5000))
        await server.start()
        print(server.port, flush=True)
        await asyncio.Event().wait()

    asyncio.run(serve())


def crowd_register(uri, apis_port, count):
    """Register `count` nodes with 10 topics each. Every topic has 100 subscribers."""
    clients = [(PiprosClient(uri, f"/n{i}"), f"http://127.0.0.1:{apis_port}/n{i}") for i in range(count)]
    topics = max(1, count * 10 // 100)
    for number, (client, api) in enumerate(clients):
        for step in range(10):
            client.registerSubscriber(f"/t{(number * 10 + step) % topics}", "std_msgs/String", api)
    print("subscribed", flush=True)
    began = time.perf_counter()
    for step in range(10):
        for number, (client, api) in enumerate(clients):
            client.registerPublisher(f"/t{(number + step) % topics}", "std_msgs/String", api)
    print(time.perf_counter() - began, flush=True)


def crowd(uri, count):
    """Return the times for getUri while the crowd registers its publishers, and the rate of registrations."""
    environment = {**os.environ, "PYTHONPATH": SOURCES}
    nodes = subprocess.Popen(  # noqa: S603
        [sys.executable, __file__, "--role", "crowd-nodes"],
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        port = nodes.stdout.readline().strip()
        registrar = subprocess.Popen(  # noqa: S603
            [sys.executable, __file__, "--role", "crowd-register", uri, port, str(count)],
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        registrar.stdout.readline()
        sys.path.insert(0, SOURCES)
        client = PiprosClient(uri)
        took = []
        while registrar.poll() is None:
            began = time.perf_counter()
            client.getUri()
            took.append(time.perf_counter() - began)
            time.sleep(0.002)
        seconds = float(registrar.stdout.readline())
        took.sort()
        return {
            f"getUri while {count} nodes become publishers, p50 ms": took[len(took) // 2] * 1e3,
            "  p99 ms": took[len(took) * 99 // 100] * 1e3,
            "  max ms": took[-1] * 1e3,
            "  registrations/s": count * 10 / seconds,
        }
    finally:
        nodes.kill()
        nodes.wait()


# ---- the masters


class MasterProcess:
    def __init__(self, world, command):
        self.port = free_port()
        self.uri = f"http://127.0.0.1:{self.port}/"
        self._home = tempfile.TemporaryDirectory(prefix="bench_master_")
        home = self._home.name
        environment = {"HOME": home, "ROS_HOME": home, "ROS_IP": "127.0.0.1", "ROS_MASTER_URI": self.uri}
        if world == "genuine":
            environment["PATH"] = "/usr/bin:/bin"
            argv = ["/usr/bin/" + command[0], *command[1:], "-p", str(self.port)]
        else:
            bin_folder = os.path.dirname(sys.executable)
            environment["PATH"] = bin_folder + ":/usr/bin:/bin"
            argv = [sys.executable, "-m", "pipros.cli." + command[0], *command[1:], "-p", str(self.port)]
        began = time.perf_counter()
        self.process = subprocess.Popen(  # noqa: S603
            argv,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
                break
            except OSError:
                time.sleep(0.002)
        self.ready_s = time.perf_counter() - began

    def resident_mb(self):
        """Return the memory used by the process and its children, counting shared memory once."""
        total = 0
        for entry in filter(str.isdigit, os.listdir("/proc")):
            try:
                if os.getsid(int(entry)) in (self.process.pid,) or is_below(int(entry), self.process.pid):
                    with open(f"/proc/{entry}/smaps_rollup") as lines:
                        total += sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
            except (OSError, ValueError):
                continue
        return total / 1024

    def stop(self):
        began = time.perf_counter()
        self.process.send_signal(signal.SIGINT)
        self.process.wait(20)
        stopped_s = time.perf_counter() - began
        self._home.cleanup()
        return stopped_s


def is_below(pid, ancestor):
    while pid > 1:
        with open(f"/proc/{pid}/stat") as file:
            pid = int(file.read().rpartition(")")[2].split()[1])
        if pid == ancestor:
            return True
    return False


def start_up(world):
    """Return roscore's start-up time, shutdown time and memory."""
    found = []
    for _ in range(START_UPS):
        master = MasterProcess(world, ["roscore"])
        # genuine roscore starts rosout after the master answers, and the figure for memory includes both
        time.sleep(2.0)
        memory = master.resident_mb()
        found.append((master.ready_s, master.stop(), memory))
    ready, gone, memory = (min(values) for values in zip(*found, strict=True))
    return {
        "start of roscore, s": ready,
        "exit of roscore after Ctrl-C, s": gone,
        "memory of roscore (PSS), MB": memory,
    }


def measure(world, workload, uri):
    python = GENUINE_PYTHON if world == "genuine" else sys.executable
    environment = {"HOME": tempfile.gettempdir(), "PATH": "/usr/bin:/bin"}
    if world == "pipros":
        environment["PYTHONPATH"] = SOURCES
    out = subprocess.run(  # noqa: S603
        [python, __file__, "--role", "client", world, workload, uri],
        env=environment,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    ).stdout
    return json.loads(out)


def rows_of(taken, results):
    """Return the rows of the workloads, and of the other figures that were measured for both masters."""
    for name, value in results["pipros"].items():
        if name not in taken and name in results.get("genuine", {}):
            taken[name] = {"genuine": [results["genuine"][name]], "pipros": [value]}
    return [Row(f"master: {name}", values, "/s" in name, best=True) for name, values in taken.items()]


def main():
    if sys.argv[1:2] == ["--role"]:
        role, *rest = sys.argv[2:]
        if role == "client":
            world, workload, uri = rest
            print(json.dumps(WORKLOADS[workload](lambda: CLIENTS[world](uri), uri)))
        elif role == "crowd-nodes":
            crowd_nodes()
        else:
            crowd_register(rest[0], rest[1], int(rest[2]))
        return
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", help="some of: " + ", ".join([*WORKLOADS, "start_up", "crowd"]))
    parser.add_argument("--json", help="also write the rows to this file")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--crowd", type=int, default=1000, help="the number of nodes in the crowd")
    options = parser.parse_args()
    heed_interrupts()
    chosen = options.only.split(",") if options.only else [*WORKLOADS, "start_up", "crowd"]
    worlds = ["genuine", "pipros"] if os.path.exists("/usr/bin/rosmaster") else ["pipros"]
    results, taken = {world: {} for world in worlds}, {}
    if set(chosen) & set(WORKLOADS):
        masters = {world: MasterProcess(world, ["rosmaster", "--core"]) for world in worlds}
        for _ in range(options.rounds):
            for workload in WORKLOADS:
                for world in worlds:
                    if workload in chosen:
                        for name, value in measure(world, workload, masters[world].uri).items():
                            better = max if name.endswith("/s") else min
                            taken.setdefault(name, {}).setdefault(world, []).append(value)
                            results[world][name] = better(value, results[world].get(name, value))
        for master in masters.values():
            master.stop()
    if "start_up" in chosen:
        for world in worlds:
            results[world].update(start_up(world))
    if "crowd" in chosen:
        master = MasterProcess("pipros", ["rosmaster", "--core"])
        results["pipros"].update(crowd(master.uri, options.crowd))
        master.stop()
    print(f"{'':66}" + "".join(f"{world:>12}" for world in worlds) + f"{'ratio':>9}")
    if options.json:
        write_json(options.json, rows_of(taken, results))
    for name, value in results["pipros"].items():
        other = results.get("genuine", {}).get(name)
        ratio = "" if other is None else f"{(value / other if name.endswith('/s') else other / value):8.2f}x"
        shown = "" if len(worlds) == 1 else f"{other:12.2f}" if other is not None else " " * 12
        print(f"{name:66}{shown}{value:12.2f}{ratio}")


if __name__ == "__main__":
    main()

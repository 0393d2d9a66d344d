#!/usr/bin/env python3
"""Speed of the master: pipros and genuine rosmaster, in one run.

    script/bench master [--only params,dictionary,registration,together,start_up,crowd] [--rounds 3]

Each master is called by its own client: the genuine master by `rosgraph.Master` in genuine ROS's Python, and
pipros by `pipros.net.master_client.MasterClient`. They alternate, and the best of the rounds counts, so that
other load affects both alike. `crowd` measures only pipros: a thousand nodes become publishers one after
another. If genuine ROS is not installed, only pipros is measured.
"""

import threading
import time

from worlds import World, answer, compare, finish, one_process, say

CROWD = 1000
STD_STRING = "std_msgs/String"


# ---- workers: in their own processes, in the Python of their implementation


def genuine_client(uri, name="/bench"):
    import rosgraph

    return rosgraph.Master(name, master_uri=uri)


class PiprosClient:
    """The master client of pipros, with the names of `rosgraph.Master`."""

    def __init__(self, uri, name="/bench"):
        from pipros.net.master_client import MasterClient

        client = MasterClient(uri, name)
        self.getParam, self.setParam, self.hasParam = client.get_param, client.set_param, client.has_param
        self.registerPublisher, self.registerSubscriber = (
            client.register_publisher,
            client.register_subscriber,
        )
        self.getUri = client.get_uri


def rate(function, count):
    function()
    began = time.perf_counter()
    for _ in range(count):
        function()
    return count / (time.perf_counter() - began)


def params(make):
    client = make()
    client.setParam("/bench/key", 42)
    return {
        "getParam calls/s": rate(lambda: client.getParam("/bench/key"), 3000),
        "setParam calls/s": rate(lambda: client.setParam("/bench/key", 42), 3000),
        "hasParam calls/s": rate(lambda: client.hasParam("/bench/key"), 3000),
    }


def dictionary(make):
    client = make()
    value = {f"group_{i}": {f"key_{j}": j * 1.5 if j % 2 else j for j in range(10)} for i in range(100)}
    return {
        "setParam of 1,000 nested keys, ms": 1e3 / rate(lambda: client.setParam("/bench/big", value), 50),
        "getParam of 1,000 nested keys, ms": 1e3 / rate(lambda: client.getParam("/bench/big"), 50),
    }


def registration(make):
    client = make()
    topics = iter(range(10**9))
    registered = rate(
        lambda: client.registerPublisher(f"/bench/t{next(topics)}", STD_STRING, "http://127.0.0.1:9/"), 1500
    )
    return {"registration, ms": 1e3 / registered}


def together(make):
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


CALLS = {"params": params, "dictionary": dictionary, "registration": registration, "together": together}


def worker_client(kind, calls, uri):
    client = genuine_client if kind == "genuine" else PiprosClient
    say(**CALLS[calls](lambda: client(uri)))


def worker_crowd_nodes():
    """Serve the APIs of a crowd of nodes, whose URIs differ only by path."""
    import asyncio

    from pipros.basics.limits import Limits
    from pipros.net.rpc_server import RpcServer

    async def serve():
        methods = {"publisherUpdate": lambda *_: [1, "", 0], "getPid": lambda _: [1, "", 1]}
        server = RpcServer(methods, limits=Limits(rpc_connections=5000, rpc_connections_per_peer=5000))
        await server.start()
        say(port=server.port)
        await asyncio.Event().wait()

    asyncio.run(serve())


def worker_crowd_register(uri, apis_port):
    """Register the nodes with 10 topics each. Every topic has 100 subscribers."""
    clients = [(PiprosClient(uri, f"/n{i}"), f"http://127.0.0.1:{apis_port}/n{i}") for i in range(CROWD)]
    topics = CROWD * 10 // 100
    for number, (client, api) in enumerate(clients):
        for step in range(10):
            client.registerSubscriber(f"/t{(number * 10 + step) % topics}", STD_STRING, api)
    say(subscribed=True)
    began = time.perf_counter()
    for step in range(10):
        for number, (client, api) in enumerate(clients):
            client.registerPublisher(f"/t{(number + step) % topics}", STD_STRING, api)
    say(seconds=time.perf_counter() - began)


# ---- the driver


def called(calls):
    def measure(world, _seconds):
        uri = world.environment["ROS_MASTER_URI"]
        figures = one_process(world, __file__, "client", world.name, calls, uri)
        return {f"master: {name}": value for name, value in figures.items()}

    return measure


def start_up(world, _seconds):
    """Return roscore's start-up time, shutdown time and memory, with that of its children."""
    import psutil  # which genuine ROS's Python may lack

    core = World(world.name, world.python, master=("roscore",))
    time.sleep(2.0)  # genuine roscore starts rosout after the master answers
    process = psutil.Process(core.master.pid)
    memory = sum(each.memory_full_info().pss for each in (process, *process.children(recursive=True)))
    return {
        "master: start of roscore, s": core.ready_s,
        "master: memory of roscore (PSS), MB": memory / (1 << 20),
        "master: exit of roscore after Ctrl-C, s": core.close(),
    }


def crowd(world, _seconds):
    """Return the times for getUri while the crowd registers its publishers, and the rate of registrations."""
    if world.name != "pipros":
        return {}
    uri = world.environment["ROS_MASTER_URI"]
    nodes = world.start(__file__, "crowd_nodes")
    registrar = world.start(__file__, "crowd_register", uri, answer(nodes)["port"])
    answer(registrar)
    client, took = PiprosClient(uri), []
    while registrar.poll() is None:
        began = time.perf_counter()
        client.getUri()
        took.append(time.perf_counter() - began)
        time.sleep(0.002)
    passed = answer(registrar)["seconds"]
    for process in (registrar, nodes):
        finish(process)
    took.sort()
    label = f"master: getUri while {CROWD} nodes become publishers"
    return {
        f"{label}, p50, ms": took[len(took) // 2] * 1e3,
        f"{label}, p99, ms": took[len(took) * 99 // 100] * 1e3,
        f"{label}, max, ms": took[-1] * 1e3,
        "master: registrations while they do/s": CROWD * 10 / passed,
    }


WORKLOADS = {**{name: called(name) for name in CALLS}, "start_up": start_up, "crowd": crowd}


if __name__ == "__main__":
    compare(__doc__, WORKLOADS, globals(), best=True)

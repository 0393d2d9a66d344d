#!/usr/bin/env python3
"""Speed of the master: pipros and genuine rosmaster, in one run.

    script/bench master [--only params,dictionary,registration,together,start_up] [--rounds 3]

Each master is called by its own client. They alternate, and the best of the rounds counts, so that other load
affects both alike. If genuine ROS is not installed, only pipros is measured.
"""

import threading
import time

from worlds import World, compare, one_process, say

STD_STRING = "std_msgs/String"


# ---- workers: in their own processes, in the Python of their implementation


def client_of(kind, uri):
    """Return a master client with the names of `rosgraph.Master`."""
    if kind == "genuine":
        import rosgraph

        return rosgraph.Master("/bench", master_uri=uri)
    from pipros.net.master_client import MasterClient

    client = MasterClient(uri, "/bench")
    client.getParam, client.setParam, client.hasParam = client.get_param, client.set_param, client.has_param
    client.registerPublisher = client.register_publisher
    return client


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
    say(**CALLS[calls](lambda: client_of(kind, uri)))


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


WORKLOADS = {**{name: called(name) for name in CALLS}, "start_up": start_up}


if __name__ == "__main__":
    compare(__doc__, WORKLOADS, globals(), best=True)

"""Implementations of ROS side by side: their masters, and the workers that benchmarks run in them.

Also runs in genuine ROS's Python, so it imports only the standard library.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time

from table import (
    TUNED,
    Load,
    Row,
    free_port,
    heed_interrupts,
    markdown,
    options_of,
    wait_for_port,
    write_json,
)

GENUINE_PYTHON = "/usr/bin/python3"
HERE = os.path.dirname(os.path.abspath(__file__))


# ---- in the processes of workers


def message(kind):
    """Return a string of 16 bytes, an Imu, an image of 1 MB or of "image:SIZE" bytes, or a cloud of 4 MB."""
    from sensor_msgs.msg import Image, Imu, PointCloud2, PointField
    from std_msgs.msg import String

    import rospy

    if kind == "string":
        return String(data="x" * 16)
    if kind == "imu":
        imu = Imu(orientation_covariance=[0.1 * i for i in range(9)])
        imu.header.frame_id, imu.header.stamp, imu.orientation.w = "imu_link", rospy.Time(1, 2), 1.0
        return imu
    if kind.startswith("image:"):
        size = int(kind.partition(":")[2])
        return Image(height=1, width=size, encoding="mono8", step=size, data=os.urandom(size))
    if kind == "image":
        return Image(height=1024, width=1024, encoding="mono8", step=1024, data=os.urandom(1 << 20))
    fields = [PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate("xyz")]
    return PointCloud2(fields=fields, height=1, width=1 << 18, point_step=16, data=os.urandom(1 << 22))


def init(name):
    import rospy

    rospy.init_node(name, anonymous=True, disable_signals=True)
    return rospy


def say(**values):
    print("@@" + json.dumps(values), flush=True)


# ---- in the process of the benchmark


class World:
    """One implementation: its Python, its master if it has one, and the processes started in it."""

    def __init__(self, name, python, variables=None, master=("rosmaster", "--core")):
        self.name, self.python = name, python
        self.home = tempfile.TemporaryDirectory()
        self.errors = open(os.path.join(self.home.name, "errors"), "w+")  # noqa: SIM115  # closed with us
        self.port = free_port()
        self.environment = {
            "HOME": self.home.name,
            "ROS_HOME": self.home.name,
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}",
            "ROS_IP": "127.0.0.1",
            "PATH": os.path.dirname(python) + ":/usr/bin:/bin",
            "TMPDIR": tempfile.gettempdir(),
            **(variables or {}),
        }
        self.master = None
        if master:
            began = time.perf_counter()
            program = os.path.join(os.path.dirname(python), master[0])
            self.master = self.spawn([program, *master[1:], "-p", str(self.port)])
            wait_for_port(self.port)
            self.ready_s = time.perf_counter() - began

    def spawn(self, argv):
        return subprocess.Popen(
            argv,
            env=self.environment,
            cwd=self.home.name,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.errors,
            text=True,
        )

    def start(self, script, role, *arguments):
        """Start a worker, a function of a benchmark, in its own process."""
        return self.spawn([self.python, os.path.abspath(script), "--worker", json.dumps([role, *arguments])])

    def work(self, role, *arguments):
        """Start a worker of script/bench client."""
        return self.start(os.path.join(HERE, "client.py"), role, *arguments)

    def has(self, _name):
        """Return whether this implementation has an equivalent of a workload."""
        return True

    def close(self):
        """Return the seconds from Ctrl-C to the end of the master."""
        began = time.perf_counter()
        if self.master:
            self.master.send_signal(signal.SIGINT)
            self.master.wait()
        passed = time.perf_counter() - began
        if self.master:
            self.master.communicate()
        self.errors.close()
        self.home.cleanup()
        return passed


class CppWorld(World):
    """roscpp, with the genuine master. The program is built by genuine catkin, once per environment."""

    def __init__(self):
        workspace = os.path.join(sys.prefix, "roscpp_workspace")
        package = os.path.join(workspace, "src", "roscpp")
        os.makedirs(os.path.dirname(package), exist_ok=True)
        if not os.path.islink(package):
            os.symlink(os.path.join(HERE, "roscpp"), package)
        built = subprocess.run(
            ["/usr/bin/catkin_make", "-C", workspace, "-DCMAKE_BUILD_TYPE=Release"],
            env={"PATH": "/usr/bin:/bin", "HOME": workspace, "CMAKE_PREFIX_PATH": "/usr"},
            capture_output=True,
            text=True,
        )
        if built.returncode:
            raise SystemExit(f"{built.stdout}{built.stderr}\ncatkin_make failed in {workspace}")
        self.program = os.path.join(workspace, "devel", "lib", "pipros_benchmarks", "client")
        super().__init__("roscpp", GENUINE_PYTHON)

    def has(self, name):
        """Exclude rospy's synchronous publishing, which roscpp lacks."""
        return name.startswith(("flow", "trip", "fan", "service", "cost")) and "None" not in name

    def work(self, role, *arguments):
        words = [str(each).lower() for each in arguments]
        return self.spawn([self.program, role, *words])


@contextlib.contextmanager
def open_worlds(tuned=True, roscpp=False):
    """Open genuine rospy, genuine rospy with a tuned allocator, roscpp, and pipros; only pipros if genuine
    ROS is not installed.
    """
    worlds = []
    try:
        if os.path.exists("/usr/lib/python3/dist-packages/rospy"):
            worlds.append(World("genuine", GENUINE_PYTHON))
            if tuned:
                worlds.append(World("tuned", GENUINE_PYTHON, TUNED))
        if roscpp and os.path.exists("/usr/share/roscpp") and os.path.exists("/usr/bin/catkin_make"):
            worlds.append(CppWorld())
        worlds.append(World("pipros", sys.executable))
        yield worlds
    finally:
        for world in worlds:
            world.close()


def answer(process):
    for line in process.stdout:
        if line.startswith("@@"):
            return json.loads(line[2:])
    raise SystemExit(f"{process.args} ended without a result, with exit code {process.wait()}")


def one_process(world, script, role, *arguments):
    """Return the answer of a worker, after its end."""
    process = world.start(script, role, *arguments)
    value = answer(process)
    finish(process)
    return value


def finish(*processes):
    for process in processes:
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
        process.terminate()
        process.stdout.close()
        process.wait()


def imported_ms(world, module):
    """Return the duration of a process that imports a module."""
    began = time.perf_counter()
    subprocess.run([world.python, "-c", f"import {module}"], env=world.environment, check=True)
    return (time.perf_counter() - began) * 1e3


def compare(
    description, workloads, functions, seconds=2.0, best=False, opened=None, quick=(), rounds=3, **more
):
    """Run a benchmark: each workload in each world, round by round, and print the rows.

    Args:
        workloads: functions by name, called with a world and a duration. They return figures by label; of
            those whose label ends in "/s", more is better.
        functions: the benchmark's globals, with its workers.
        best: whether the best round counts instead of the median.
        opened: a context with the worlds; by default those of `open_worlds`, without the tuned one.
        quick: the names of the workloads that `--quick` runs.
        more: other options of the command line, with their defaults.

    Returns:
        The options and the rows by workload; no rows in a worker.
    """
    shared = {"only": "", "rounds": rounds, "seconds": seconds, "quick": False, "json": "", "worker": ""}
    options = options_of(description, **shared, **more)
    if options.worker:
        role, *arguments = json.loads(options.worker)
        functions[f"worker_{role}"](*arguments)
        return options, {}
    heed_interrupts()
    load = Load()
    time.sleep(1.0)
    print(f"others use {load.percent():.0f} % of the machine\n", file=sys.stderr)
    wanted, taken = tuple(options.only.split(",")), {}
    with opened or open_worlds(tuned=False) as worlds:
        for name, workload in workloads.items():
            if name.startswith(wanted) and (not options.quick or not quick or name in quick):
                taken[name] = {}
                for world in [each for each in worlds if each.has(name)] * options.rounds:
                    for label, value in workload(world, options.seconds).items():
                        taken[name].setdefault(label, {}).setdefault(world.name, []).append(value)
                print(".", end="", file=sys.stderr, flush=True)
    rows = {
        name: [Row(label, values, label.endswith("/s"), best=best) for label, values in figures.items()]
        for name, figures in taken.items()
    }
    every = [row for found in rows.values() for row in found]
    print("\n" + markdown(every))
    if options.json:
        write_json(options.json, every)
    return options, rows

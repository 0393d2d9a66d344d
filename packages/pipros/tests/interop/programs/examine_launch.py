"""Use the Python API of roslaunch as scripts do, and print the outcomes; for both implementations.

examine_launch.py FOLDER: a package `programs` with `sleeper`, `fails` and `ends`, and a master is running
"""

import contextlib
import io
import json
import os
import re
import sys
import tempfile
import threading

import roslaunch
import roslaunch.config
import roslaunch.core
import roslaunch.launch
import roslaunch.loader
import roslaunch.netapi
import roslaunch.node_args
import roslaunch.nodeprocess
import roslaunch.parent
import roslaunch.pmon
import roslaunch.rlutil
import roslaunch.scriptapi
import roslaunch.substitution_args
import roslaunch.xmlloader

UNSTABLE = re.compile(r"\d{15,}|0x[0-9a-f]+|pid \[?\d+")
"""Random numbers, addresses and process ids."""

core, rlutil = roslaunch.core, roslaunch.rlutil
FOLDER = sys.argv[1]
OUTER = os.path.join(FOLDER, "x.launch")
INNER = os.path.join(FOLDER, "y.launch")
BAD = os.path.join(FOLDER, "bad.launch")
FULL = os.path.join(FOLDER, "full.launch")
Node, Test, Machine, RLException = (
    core.Node, core.Test, core.Machine, core.RLException,
)  # fmt: skip
MASTER_PARAMETERS = ("/rosdistro", "/rosversion")


def examine(label, function, words=True, output=True):
    """Print the outcome of a call: with `words` the first line of an error, with `output` its output."""
    try:
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            result = function()
        record = [repr(result), printed.getvalue() if output else ""]
    except SystemExit as end:
        record = ["exit", end.code]
    except Exception as error:
        aliases = [
            one for one in (RLException, roslaunch.substitution_args.ArgException) if type(error) is one
        ]
        kind = "alias" if aliases else type(error).__name__
        record = ["error", kind, str(error).splitlines()[0] if words else ""]
    record = [UNSTABLE.sub("NUMBER", one) if isinstance(one, str) else one for one in record]
    print("@@" + json.dumps([label, record]), flush=True)


def wait_for(condition):
    pause = threading.Event()
    for _ in range(3000):
        if condition():
            return True
        pause.wait(0.01)
    return False


class Deaths(roslaunch.pmon.ProcessListener):
    def __init__(self):
        self.names = []

    def process_died(self, process_name, exit_code):
        self.names.append(process_name.rpartition("-")[0])


def loaded(text="", files=(), **more):
    texts = ["<launch>" + text + "</launch>"] if text else None
    return roslaunch.config.load_config_default(list(files), None, roslaunch_strs=texts, **more)


def examine_values():
    node = Node("a", "b", "c", "//g//", args="1 <2>", remap_args=[("x", "y")], env_args=[("E", "v")])
    for name in sorted({*core.Node.__slots__} - {"_rest"}):
        examine("node " + name, lambda: getattr(node, name))
    test = Test("tt", "a", "b", name="n", time_limit=3, retry=2, cwd="ros_home", launch_prefix="nice")
    for name in [*sorted({*core.Node.__slots__} - {"_rest"}), "test_name", "time_limit", "retry"]:
        examine("test " + name, lambda: getattr(test, name))
    machine = Machine("m", "h", "/env.sh", 2222, "ada", "secret", timeout=3)
    for name in sorted(core.Machine.__slots__):
        examine("machine " + name, lambda: getattr(machine, name))
    examine("machine text", lambda: str(machine))
    examine("machine key", machine.config_key)
    other = Machine("other", "h", "/env.sh", 2222, "ada", "secret", timeout=3)
    examine(
        "machines", lambda: [machine == other, machine.config_equals(other), machine == 3, machine != other]
    )
    local = core.local_machine()
    examine("local", lambda: [str(local), local is core.local_machine()])
    examine("is local", lambda: core.is_machine_local(local))
    examine("is local 2", lambda: core.is_machine_local(Machine("a", "127.0.0.1", user="nobody-else")))
    examine("unknown host", lambda: core.is_machine_local(Machine("a", "no.such.host.invalid")))
    param = core.Param("a//b/", 3)
    examine("param", lambda: [param.key, str(param), repr(param), param == core.Param("a/b", 3)])
    examine("executable", lambda: [str(core.Executable("x", ("y",))), core.Executable("x", ()).phase])
    examine("rosbin", lambda: repr(core.RosbinExecutable("rosparam", ("a", "b"), "setup")))
    for label, arguments in {
        "type": ("a", ""), "package": (" ", "b"), "name": ("a", "b", "x/y"),
    }.items():  # fmt: skip
        examine("bad " + label, lambda: Node(*arguments))
    for more in ({"cwd": "NODE"}, {"output": "x"}, {"respawn": True, "required": True}):
        examine(f"bad {sorted(more)}", lambda: Node("a", "b", **more))
    for limit in ("x", -1, 0, 2.5):
        examine(f"limit {limit}", lambda: Test("a", "b", "c", time_limit=limit).time_limit)
    for name in (None, 3, "", "a", "/a/b/c"):
        examine(f"namespaces of {name}", lambda: roslaunch.config.namespaces_of(name))
    master = core.Master()
    examine(
        "master", lambda: [master.uri, master.get_host(), master.get_port(), master.is_running(), master.type]
    )
    examine("other master", lambda: core.Master(uri="http://127.0.0.1:1/").is_running())
    examine("masters", lambda: [master == core.Master(), master == core.Master(uri="http://a:1")])
    examine("proxy", lambda: master.get().getPid("/x")[0])
    examine("printed", lambda: core.printlog("hello"))
    heard = []
    core.add_printlog_handler(heard.append)
    examine("bold", lambda: core.printlog_bold("bold"))
    core.clear_printlog_handlers()
    examine("plain", lambda: core.printlog("plain"))
    examine("heard", lambda: heard)


def examine_configurations():
    config = roslaunch.config.load_config_default([(FULL, ["x:=1"])], 11999, verbose=False)
    for one in (*config.nodes, *config.tests):
        examine("more of " + one.name, lambda: [
            one.output, one.cwd, one.filename == FULL, one.remap_args, one.env_args, one.machine_name,
            one.machine is not None, one.process_name, one.namespace,
        ])  # fmt: skip
    examine(
        "nodes",
        lambda: [[one.name for one in part] for part in (config.nodes, config.nodes_core, config.tests)],
    )
    examine(
        "params", lambda: sorted((k, v.value) for k, v in config.params.items() if k not in MASTER_PARAMETERS)
    )
    examine("names", lambda: config.resolved_node_names)
    examine("rest", lambda: [config.clear_params, config.executables, [e.args for e in config.executables]])
    examine("errors", lambda: [error.partition(":")[0] for error in config.config_errors])
    examine("files", lambda: config.roslaunch_files[1:])
    examine("port", lambda: config.master.get_port())
    examine("machines", lambda: sorted(config.machines))
    examine("remote", config.has_remote_nodes)
    for local in (True, False):
        config.params.pop("/rosdistro", None)
        examine(f"summary {local}", lambda: config.summary(local=local))
    examine("no machines yet", roslaunch.ROSLaunchConfig().has_remote_nodes)
    examine("twice", lambda: config.add_node(config.nodes[0]))
    examine("verbose", lambda: config.add_node(Node("a", "b", "later"), verbose=True))
    examine("core without name", lambda: config.add_node(Node("a", "b"), core=True))
    examine("core", lambda: config.add_node(Node("a", "b", "core"), core=True, verbose=True))
    examine("no executable", lambda: config.add_executable(None))
    examine("machine again", lambda: config.add_machine(Machine("m", "elsewhere", "/e")))
    examine("machine", lambda: config.add_machine(Machine("m2", "127.0.0.1", "/e"), verbose=True))
    examine("same machine", lambda: config.add_machine(Machine("m2", "127.0.0.1", "/e"), verbose=True))
    examine("param", lambda: config.add_param(core.Param("/p/q", 1), verbose=True))
    examine("conflict", lambda: config.config_errors[-1])
    examine("unknown machine", lambda: loaded('<node pkg="a" type="b" name="n" machine="zz"/>'))
    examine(
        "not assigned",
        lambda: (
            loaded('<node pkg="a" type="b" name="n" machine="zz"/>', assign_machines=False)
            .nodes[0]
            .machine_name
        ),
    )
    examine("no file", lambda: loaded(files=["/nope"]), words=False)
    examine("no xml", lambda: roslaunch.config.load_config_default([], None, roslaunch_strs=["<launch"]))
    examine("bad element", lambda: loaded(files=[BAD]))
    examine("unset", lambda: loaded(files=[OUTER]), words=False)
    examine("unset ignored", lambda: [n.name for n in loaded(files=[OUTER], ignore_unset_args=True).nodes])


class Recorder:
    """Replaces a configuration."""

    def __init__(self):
        self.calls = []

    def __getattr__(self, name):
        return lambda *values, **more: self.calls.append((name, [type(value).__name__ for value in values]))


def examine_loaders():
    loader = roslaunch.xmlloader.XmlLoader(resolve_anon=False)
    recorder = Recorder()
    examine("load", lambda: loader.load(FULL, recorder, argv=["x:=1"], verbose=False))
    examine("calls", lambda: recorder.calls)
    config = roslaunch.ROSLaunchConfig()
    text = '<launch><rosparam command="delete" param="x"/><rosparam command="dump" file="/tmp/o"/></launch>'
    examine("text", lambda: loader.load_string(text, config, verbose=False))
    examine("executables", lambda: [[e.command, e.args, e.phase] for e in config.executables])
    examine(
        "arguments only",
        lambda: roslaunch.xmlloader.XmlLoader(args_only=True).load(BAD, config, argv=[], verbose=False),
    )
    for value, kind in (
        ("1.5", "auto"), ("x", "int"), ("1_0", "auto"), ("TRUE", "auto"), ("[1, 2]", "yaml"), ("2", "bool"),
        ("x", "nope"), ("7", "str"), ("7", "double"), (" true ", "boolean"), ("1_0.5", "auto"),
    ):  # fmt: skip
        examine(f"convert {value} {kind}", lambda: roslaunch.loader.convert_value(value, kind))
    examine(
        "kinds",
        lambda: [
            issubclass(kind, RLException)
            for kind in (roslaunch.loader.LoadException, roslaunch.XmlParseException)
        ],
    )
    rosparam = '<rosparam command="foo" file="x"/>'
    for element in (
        rosparam, "<rosparam>[1</rosparam>", '<group ns=""/>', '<group if="1" unless="1"/>', "<machine/>",
    ):  # fmt: skip

        def load():
            try:
                text = f"<launch>{element}</launch>"
                roslaunch.XmlLoader().load_string(text, roslaunch.config.ROSLaunchConfig(), verbose=False)
            except RLException as error:
                return type(error).__name__, str(error).splitlines()[0], len(str(error).splitlines()) == 1

        examine(element, lambda: load()[: 2 if "rosparam" in element else 3])


def examine_unset_arguments():
    folder = tempfile.mkdtemp()
    with open(os.path.join(folder, "package.xml"), "w") as file:
        file.write("<package><name>p</name><version>1.0.0</version><description>d</description>")
        file.write('<maintainer email="a@b.com">m</maintainer><license>BSD</license></package>')
    os.environ["ROS_PACKAGE_PATH"] = folder + os.pathsep + os.environ["ROS_PACKAGE_PATH"]
    for name, content in INCLUDED.items():
        with open(os.path.join(folder, f"{name}.launch"), "w") as file:
            file.write(f"<launch>{content}</launch>")
    path = os.path.join(folder, "a.launch")
    for content in CHECKED:
        with open(path, "w") as file:
            file.write(f"<launch>{content}</launch>")

        def check(unset):
            with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
                return rlutil.check_roslaunch(path, ignore_unset_args=unset) is None

        examine(content, lambda: check(True))
        if "x" not in content and "needs" not in content:  # otherwise, genuine ROS raises an exception
            examine(content, lambda: check(False))


_NODE = '<node name="n" pkg="p" type="t"/>'
_LOST = '<node name="n" pkg="nowhere" type="t"/>'
_X = '<arg name="x"/>'

INCLUDED = {
    "needs": f"{_X}{_LOST}",
    "uses": f'{_X}<param name="p" value="$(arg x)"/><bad/><node name="n"/>',
    "lost": _LOST,
}
CHECKED = (
    f'{_X}<node name="n" pkg="$(arg x)" type="t"/>', f'{_X}<node name="n" pkg="$(arg x)_y" type="t"/>',
    f'{_X}<node name="n" pkg="p" type="$(arg x)"/>', f'{_X}<node name="$(arg x)" pkg="p" type="t"/>',
    f'{_X}<node name="n" pkg="nowhere" type="t" args="$(arg x)"/>',
    f'{_X}<node name="n" pkg="nowhere" type="t" machine="$(arg x)"/>',
    f'{_X}<node name="n" pkg="nowhere" type="t" respawn="$(arg x)"/>', _NODE, _LOST, f"{_X}{_LOST}",
    f"{_LOST}{_X}", f'{_X}<group if="$(arg x)">{_LOST}</group>', f'{_X}<group ns="$(arg x)">{_LOST}</group>',
    f'<group>{_X}</group><param name="p" value="$(arg x)"/>{_LOST}', f'{_X}<include file="$(arg x)"/>',
    f'{_X}<include file="$(dirname)/$(arg x).launch"/>{_LOST}',
    f'{_X}<param name="p" value="$(eval arg(\'x\') * 2)"/><node name="n"/>',
    f'{_X}<arg name="y" default="$(arg x)"/><node name="n" pkg="$(arg y)" type="t"/>',
    f'{_X}<include file="$(dirname)/uses.launch"><arg name="z" value="$(arg x)"/></include>',
    f'{_X}<arg name="y" if="$(arg x)" default="$(arg x)"/>{_LOST}', f'{_X}<arg name="$(arg x)" default="1"/>',
    f'{_X}<node name="n"/>', f'{_X}<node name="n" pkg="p" type="t" machine="nowhere"/>',
    f'{_X}<param name="p" value="$(arg x)"/><node name="n"/>', '<include file="$(dirname)/lost.launch"/>',
    f'{_X}<include file="$(dirname)/lost.launch"/>', '<include file="$(dirname)/needs.launch"/>',
    f'<include file="$(dirname)/needs.launch"/>{_LOST}',
    '<include file="$(dirname)/needs.launch"><arg name="x" value="1"/></include>',
    '<include file="$(dirname)/uses.launch"/>', f'<include file="$(dirname)/uses.launch"/>{_LOST}',
    '<include file="$(dirname)/uses.launch"/><node name="n"/>',
    '<include file="$(dirname)/uses.launch"><arg name="z" value="1"/></include>',
    '<include file="$(dirname)/none.launch"/>',
)  # fmt: skip


def examine_nodes():
    node = Node("programs", "sleeper", "s", "/g", args="a 'b c'", env_args=[("E", "1")], launch_prefix="nice")
    local, file = roslaunch.core.local_machine(), os.path.join(FOLDER, "nodes.launch")
    for env in ({"ROS_NAMESPACE": "/x", "A": "b"}, {}):
        examine(f"environment {env}", lambda: roslaunch.core.setup_env(node, local, "http://m:1", env))
    examine("command", lambda: roslaunch.node_args.create_local_process_args(node, local))
    for uri in ("http://localhost:1/", "http://localhost", "http://there.invalid:1", "nonsense"):
        for force in (False, True):
            examine(f"{uri} {force}", lambda: roslaunch.core.remap_localhost_uri(uri, force))
    with open(file, "w") as launch:
        launch.write(
            '<launch><node pkg="programs" type="sleeper" name="a" ns="g"><env name="E" value="a b"/></node>'
            '<test test-name="t" pkg="programs" type="fails"/></launch>'
        )
    for name in ("/g/a", "t", "absent"):
        examine(f"arguments of {name}", lambda: roslaunch.node_args.get_node_args(name, [file]))
        examine(f"file of {name}", lambda: roslaunch.node_args.print_node_filename(name, [file]))
    examine("nodes", lambda: roslaunch.node_args.print_node_list([file]))
    examine("processes", lambda: roslaunch.netapi.list_processes("http://127.0.0.1:1"))


def examine_tools():
    given = [(OUTER, ["r:=3"])]
    for label, call in {
        "check": lambda: rlutil.check_roslaunch(INNER),
        "resolve": lambda: rlutil.resolve_launch_arguments(["programs", "x.launch", "a:=1"]),
        "resolve path": lambda: rlutil.resolve_launch_arguments([OUTER]),
        "resolve none": lambda: rlutil.resolve_launch_arguments(["programs", "no.launch"]),
        "resolve no path": lambda: rlutil.resolve_launch_arguments(["no.launch"]),
        "resolve nothing": lambda: rlutil.resolve_launch_arguments([]),
        "run id": lambda: rlutil.get_or_generate_uuid("given", False),
        "run id of master": lambda: (
            rlutil.get_or_generate_uuid(None, True) == core.Master().get().getParam("/x", "/run_id")[2]
        ),
    }.items():
        examine(label, call)
    examine("files", lambda: sorted(printed(lambda: rlutil.print_file_list(given)).split()))
    examine("bad", lambda: loaded(files=[BAD]))


def printed(function):
    with contextlib.redirect_stdout(io.StringIO()) as out:
        function()
    return out.getvalue()


def examine_parents(run_id):
    deaths = Deaths()
    parent = roslaunch.parent.ROSLaunchParent(run_id, [(OUTER, ["r:=3"])], process_listeners=[deaths])
    examine("before", lambda: [parent.config, parent.pm, parent.runner, parent.server])
    parent._load_config()
    examine("loaded", lambda: [(n.name, n.args, n.remap_args, n.env_args) for n in parent.config.nodes])
    parent.config.nodes[0].args = "77"
    parent.start()
    # The monitor records an end after it has removed the process from those that are active.
    examine(
        "f ends",
        lambda: wait_for(lambda: list(map(len, parent.pm.get_process_names_with_spawn_count())) == [1, 1]),
        output=False,
    )
    examine("processes", lambda: parent.pm.get_process_names_with_spawn_count())
    process = parent.pm.get_process("a-1")
    examine("arguments", lambda: process.args[1:-1])
    examine(
        "what it is",
        lambda: [isinstance(process, roslaunch.nodeprocess.LocalProcess), str(process), process.package],
    )
    examine("info", lambda: sorted(process.get_info()))
    examine("name", lambda: [n.process_name for n in parent.config.nodes])
    examine("running", lambda: parent.runner.is_node_running(parent.config.nodes[0]))
    node = Node("programs", "sleeper", "n", "/g", respawn=True)
    respawning, success = parent.runner.launch_node(node)
    examine(
        "launched",
        lambda: [success, respawning.is_alive(), respawning.name, node.process_name, respawning.spawn_count],
    )
    respawning.stop()
    examine(
        "restarted",
        lambda: wait_for(lambda: respawning.spawn_count == 2 and respawning.is_alive()),
        output=False,
    )
    examine("killed", lambda: parent.pm.kill_process("a-1"), output=False)
    examine("gone", lambda: wait_for(lambda: not parent.pm.has_process("a-1")), output=False)
    examine("died", lambda: wait_for(lambda: {"a", "g/n"} <= set(deaths.names)), output=False)
    examine("none", lambda: parent.runner.launch_node(Node("programs", "nope", "x")))
    parent.shutdown()
    parent.shutdown()
    examine(
        "done",
        lambda: [parent.pm.done, parent.pm.is_alive(), parent.pm.get_active_names(), respawning.is_alive()],
    )
    script = roslaunch.scriptapi.ROSLaunch()
    examine("too early", lambda: script.launch(node))
    script.start()
    examine("no node", lambda: script.launch("x"))
    examine("nothing", lambda: script.launch(Node("programs", "nope")), words=False)
    process = script.launch(Node("programs", "sleeper", "s"))
    examine("alive", lambda: [process.is_alive(), process.name, process.exit_code, process.log_output])
    process.stop()
    examine("stopped", lambda: [process.is_alive()], output=False)
    script.stop()
    for more in ({"sigint_timeout": 0}, {"sigterm_timeout": -1}):
        examine(f"timeouts {sorted(more)}", lambda: roslaunch.parent.ROSLaunchParent(run_id, [], **more))
    required = roslaunch.parent.ROSLaunchParent(run_id, [INNER], force_required=True)
    required.start()
    examine("required", lambda: wait_for(lambda: required.pm.done), output=False)
    required.shutdown()
    ending = roslaunch.parent.ROSLaunchParent(run_id, [INNER])
    ending.start()
    ending.spin()
    examine("all ended", lambda: ending.pm.done)


def examine_runners(run_id):
    text = (
        '<param name="rp" value="5"/><node pkg="programs" type="sleeper" name="r1"/>'
        '<node pkg="programs" type="nope" name="r2"/>'
    )
    config = loaded(text)
    pm = roslaunch.pmon.start_process_monitor()
    runner = roslaunch.launch.ROSLaunchRunner(run_id, config, server_uri="http://127.0.0.1:1/", pmon=pm)
    started, failed = runner.launch()
    examine("runner", lambda: [len(started), failed, runner.is_node_running(config.nodes[0])])
    examine("parameter", lambda: core.Master().get().getParam("/x", "/rp"))
    for test in (
        Test("t1", "programs", "ends", "t1"),
        Test("t2", "programs", "sleeper", "t2", time_limit=1.0),
        Test("t3", "programs", "nope", "t3"),
    ):
        test.machine = core.local_machine()
        examine("test " + test.name, lambda: runner.run_test(test), output=False)
    pm.shutdown()
    pm.join()
    examine("ended", lambda: [pm.done, pm.get_active_names()])


def main():
    examine_values()
    examine_configurations()
    examine_loaders()
    examine_unset_arguments()
    examine_nodes()
    examine_tools()
    run_id = rlutil.get_or_generate_uuid(None, True)
    examine_parents(run_id)
    examine_runners(run_id)


if __name__ == "__main__":
    main()

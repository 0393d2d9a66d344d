"""The deliberate differences of the Python API, with reasons: one table for test and documentation.

Names are patterns of full names, `module.Name` or `module.Class.member`, in which `*` matches any characters.
`docs/differences.md` has the same table: `python -m tests.interop.python_api_differences` prints it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Kind(Enum):
    """The kind of difference."""

    NAMED = "can only be imported and named"
    ABSENT = "does not exist"
    DIFFERS = "differs"


@dataclass(frozen=True)
class Difference:
    kind: Kind
    reason: str
    names: tuple[str, ...]


DIFFERENCES = [
    Difference(
        Kind.NAMED,
        "internals of genuine rospy's transport: pipros has its own (`pipros.net`), and these are useless "
        "without the rest of rospy",
        (
            "rospy.*.ConnectionStatisticsLogger",
            "rospy.*.Poller",
            "rospy.*.QueuedConnection",
            "rospy.*.ROSHandler",
            "rospy.*.RegManager",
            "rospy.*.SubscriberStatisticsLogger",
            "rospy.*.TCPROSHandler",
            "rospy.*.TCPROSPub",
            "rospy.*.TCPROSServer",
            "rospy.*.TCPROSServiceClient",
            "rospy.*.TCPROSSub",
            "rospy.*.TCPROSTransport",
            "rospy.*.TCPROSTransportProtocol",
            "rospy.*.TCPServer",
            "rospy.*.TCPService",
            "rospy.impl.tcpros_pubsub.robust_connect_subscriber",
            "rospy.impl.tcpros_service.service_connection_handler",
        ),
    ),
    Difference(
        Kind.DIFFERS,
        "the parameter is called `str`, as in the message classes that genuine genpy generates",
        ("*.Message.deserialize",),
    ),
    Difference(
        Kind.ABSENT,
        "parts of generators of message code, whose templates run Python code; `catkin_make` generates C++ "
        "headers in another way",
        ("genmsg.command_line*", "genmsg.deps*", "genmsg.template_tools*"),
    ),
    Difference(
        Kind.ABSENT,
        "they belong to rosbuild and its stacks, which catkin replaced; `roslib.manifest` reads a "
        "`manifest.xml`",
        ("roslib.manifestlib*", "roslib.stack_manifest*", "roslib.stacks*"),
    ),
    Difference(
        Kind.ABSENT,
        "threads and servers of genuine processes, which pipros does not have; use "
        "`roslaunch.pmon`, `concurrent.futures`, or `rosgraph.xmlrpc.XmlRpcNode`",
        (
            "rosgraph.xmlrpc.*XMLRPC*",
            "rosmaster.threadpool*",
            "*.MarkedThreadPool",
            "rosunit.*pmon*",
            "rosunit.baretest.LocalProcess",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they change PyYAML's loaders and dumpers for the whole process; pipros has its own",
        (
            "rosmsg.construct_ordered_mapping",
            "rosmsg.construct_yaml_map_with_ordered_dict",
            "rosmsg.init_rosmsg_proto",
            "rosmsg.represent_ordered_mapping",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they write the Python source of message classes; pipros compiles classes without source files",
        (
            "genpy.dynamic.msg_generator",
            "genpy.generate_numpy.*",
            "genpy.generate_struct.*",
            "genpy.generate_initpy.*",
            "genpy.generator.*",
            "genpy.genpy_main.*",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "parts of the genuine master, launcher and build, which no public package was found to import; "
        "`rosmaster.master.Master` is a master, `genmsg` reads definitions, and `rosgraph`, `roslaunch-deps` "
        "and `roslaunch` with `--nodes`, `--args` or `--dump-params` are commands",
        (
            "rosgraph.rosgraph_main*",
            "roslaunch.arg_dump*",
            "roslaunch.depends*",
            "roslaunch.netapi*",
            "roslaunch.node_args*",
            "roslaunch.*param_dump*",
            "roslaunch.roslaunch_logs*",
            "roslaunch.server*",
            "roslib.gentools*",
            "roslib.srvs*",
            "rosmaster.master_api*",
            "rosmaster.paramserver*",
            "rosmaster.registrations*",
            "rosmaster.util*",
            "rosmaster.validators*",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "processes that the genuine launcher starts for itself, which no public package was found to use; "
        "`ROSLaunchParent` and `ROSLaunch` start, watch and stop nodes, and `subprocess` other programs",
        (
            "roslaunch.pmon.DeadProcess*",
            "roslaunch.*create_local_process_args",
            "roslaunch.*create_*_process",
            "roslaunch.*Process.get_exit_description",
            "roslaunch.*Process.should_respawn",
            "roslaunch.*Process.start",
            "roslaunch.*ProcessMonitor.*main_thread_jobs",
            "roslaunch.*ProcessMonitor.*register*",
            "roslaunch.*ProcessMonitor.*_list",
            "roslaunch.*ProcessMonitor.*_procs",
            "roslaunch.*ProcessMonitor.*_signals",
            "roslaunch.*ProcessMonitor.plock",
            "roslaunch.*Process.lock",
            "roslaunch.*Process.time_of_death",
        ),
    ),
    Difference(
        Kind.DIFFERS,
        "only launches create instances, one for each of their nodes",
        ("roslaunch.*LocalProcess",),
    ),
    Difference(
        Kind.ABSENT,
        "parts of the genuine reader of launch files, and what it passes to launchers on other machines; "
        "`XmlLoader` reads files into a `ROSLaunchConfig`",
        (
            "roslaunch.*.Loader*",
            "roslaunch.loader.load_sysargs_into_context",
            "roslaunch.loader.*process_include_args",
            "roslaunch.xmlloader.ifunless*",
            "roslaunch.*XmlLoader.*_ATTRS",
            "roslaunch.*XmlLoader.*_attrs",
            "roslaunch.*XmlLoader.*",
            "roslaunch.*.to*_xml",
            "roslaunch.*.xmlattrs",
            "roslaunch.*.xmltype",
            "roslaunch.*_child_mode",
            "roslaunch.*remap_localhost_uri",
            "roslaunch.*rle_wrapper",
            "roslaunch.*setup_env",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "a second reader of definitions, from before `genmsg`, which has the same functions",
        (
            "roslib.msgs.EXTENDED_BUILTINS",
            "roslib.msgs.Field*",
            "roslib.msgs.MsgSpec",
            "roslib.msgs.REGISTERED_TYPES",
            "roslib.msgs.VERBOSE",
            "roslib.msgs.*load_*",
            "roslib.msgs.*register*",
            "roslib.msgs.get_pkg_msg_specs",
            "roslib.msgs.reinit",
            "roslib.msgs.*_verbose",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "internals of the subcommands of `rosmsg`; `rosmsgmain` runs the command",
        (
            "rosmsg.RosMsgProto*",
            "rosmsg.fullusage",
            "rosmsg.rosmsg_cmd_[!p]*",
            "rosmsg.rosmsg_cmd_package*",
            "rosmsg.rosmsg_debug",
            "rosmsg.spec_to_str",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "parts of genuine catkin's build and commands; `catkin_make`, `catkin_init_workspace` and "
        "`catkin_test_results` of pipros work without them",
        (
            "catkin.builder*",
            "catkin.cmake*",
            "catkin.init_workspace*",
            "catkin.package_version*",
            "catkin.terminal_color*",
            "catkin.test_results*",
            "catkin.tidy_xml*",
            "catkin.workspace_vcs*",
        ),
    ),
    Difference(
        Kind.DIFFERS,
        "a decorated function with the same arguments",
        ("roslib.scriptutil.get_*", "roslib.scriptutil.script_resolve_name"),
    ),
    Difference(
        Kind.DIFFERS,
        "they are raised and caught as in Noetic, but their class, or its base class, has a different "
        "name in pipros",
        (
            "*.ArgException",
            "*.FatalProcessLaunch",
            "*.RLException",
            "*.SubstitutionException",
            "roslaunch.launch.RLTestTimeoutException",
            "roslaunch.loader.LoadException",
            "roslaunch.*XmlParseException",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "launch children in genuine processes: pipros starts each node on another machine through ssh, "
        "and `roslaunch --child` is `pipros.launch.child`",
        (
            "roslaunch.child*",
            "roslaunch.remote.*",
            "roslaunch.remoteprocess.*",
            "roslaunch.*ChildROSLaunchProcess*",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "parts that pipros's launchers do not have, and names that modules import for internal use",
        (
            "roslaunch.loader.rosparam",
            "rostest.runner.rostestRunner",
            "rosunit.*.python2",
            "rosunit.junitxml.RE_XML_ILLEGAL",
            "rosunit.junitxml.invalid_chars",
            "rosunit.junitxml.pattern",
        ),
    ),
    Difference(
        Kind.DIFFERS,
        "the master of a test is started by its launch; this is the `Master` of `roslaunch.core`",
        ("rostest.rostest_parent.Master",),
    ),
    Difference(
        Kind.DIFFERS,
        "inherited from Python's `unittest`",
        ("rosunit.*.BareTestCase.setUp", "rosunit.*.BareTestCase.tearDown"),
    ),
    Difference(
        Kind.ABSENT,
        "internals of the command, whose rules pipros implements except those about rosdep's database, "
        "pip, Debian packages and rosbuild; plugins add their own with `roswtf.rules`, "
        "and read a `roswtf.context.WtfContext`",
        (
            "roswtf.environment*",
            "roswtf.graph*",
            "roswtf.network*",
            "roswtf.packages*",
            "roswtf.plugins*",
            "roswtf.py_pip_deb_checks*",
            "roswtf.rosdep_db*",
            "roswtf.roslaunchwtf*",
            "roswtf.stacks*",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "internals of `rosconsole echo`; use the options of the command",
        ("rospy.rosconsole.RosConsoleEcho*",),
    ),
    Difference(
        Kind.DIFFERS,
        "an attribute set by the constructor, not a method",
        ("rospy.*Service.error_handler", "rospy.*ServiceImpl.error_handler"),
    ),
    Difference(
        Kind.ABSENT,
        "internal methods and state of these classes, which pipros implements differently",
        (
            "actionlib.*INVALID_TRANSITION",
            "actionlib.*NO_TRANSITION",
            "actionlib.*g_goal_id",
            "actionlib.*CommStateMachine.set_state",
            "actionlib.*CommStateMachine.transition_to",
            "actionlib.*SimpleActionServer.terminate_mutex",
            "actionlib.goal_id_generator.s_goalcount*",
            "actionlib.nop_cb",
            "actionlib.simple_action_server.nop_cb",
            "bondpy.BondSM_sm.*",
            "bondpy.bondpy.Bond.[A-Z]*",
            "bondpy.bondpy.Bond.*_timer",
            "bondpy.bondpy.Bond.condition",
            "bondpy.bondpy.Bond.deadline",
            "bondpy.bondpy.Bond.lock",
            "bondpy.bondpy.Bond.pending_callbacks",
            "bondpy.bondpy.Bond.pub",
            "bondpy.bondpy.Bond.sub",
            "bondpy.bondpy.Bond.thread",
            "bondpy.bondpy.Timeout.deadline",
            "bondpy.bondpy.Timeout.left",
            "bondpy.bondpy.Timeout.timer",
            "diagnostic_updater.FrequencyStatus.count",
            "diagnostic_updater.FrequencyStatus.hist_indx",
            "diagnostic_updater.FrequencyStatus.seq_nums",
            "diagnostic_updater.FrequencyStatus.times",
            "diagnostic_updater.TimeStampStatus.*_count",
            "diagnostic_updater.TimeStampStatus.*_delta",
            "diagnostic_updater.TimeStampStatus.deltas_valid",
            "diagnostic_updater.TimeStampStatus.zero_seen",
            "interactive_markers.*InteractiveMarkerServer.doSetPose",
            "interactive_markers.*MarkerContext.last_feedback",
            "interactive_markers.*MenuHandler.doInsert",
            "interactive_markers.*MenuHandler.makeEntry",
            "interactive_markers.*MenuHandler.pushMenuEntries",
            "message_filters.*TimeSynchronizer.last_added",
            "message_filters.*TimeSynchronizer.latest_stamps",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "by mistake a function in Noetic, where a class was intended; it returns None",
        ("actionlib_tools.library.YAMLBag",),
    ),
    Difference(
        Kind.ABSENT,
        "they write the sources for a build; pipros reads `.cfg` files without one",
        (
            "dynamic_reconfigure.parameter_generator*.LINEDEBUG",
            "dynamic_reconfigure.parameter_generator*.ParameterGenerator.*",
            "dynamic_reconfigure.parameter_generator*.check_*",
            "dynamic_reconfigure.parameter_generator*.id",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "it looks for a key that no description has",
        ("dynamic_reconfigure.encoding.get_parents",),
    ),
    Difference(
        Kind.DIFFERS,
        "a dictionary, with the arguments of Python's `dict`",
        ("dynamic_reconfigure.encoding.Config",),
    ),
    Difference(
        Kind.ABSENT,
        "migration rules are parsed and interpreted by `pipros.bag.migration`; they are not Python classes",
        ("rosbag.migration.*", "rosbag.rosbag_main.MessageMigrator.*"),
    ),
    Difference(
        Kind.ABSENT,
        "internals of the command `rosbag`, and names that modules define for internal use",
        (
            "rosbag.rosbag_main.*_op",
            "rosbag.rosbag_main.handle_*",
            "rosbag.rosbag_main.print_trans",
            "rosbag.rosbag_main.ProgressMeter",
            "rosbag.rosbag_main.RosbagCmds",
            "rosbag.bag.ComparableMixin",
            "rosbag.bag.found_lz4",
            "diagnostic_analysis.sparse.PKG",
        ),
    ),
]


def as_markdown() -> str:
    """Return the table of the documentation."""
    rows = ["| names | what | why |", "| --- | --- | --- |"]
    for difference in DIFFERENCES:
        names = ", ".join(f"`{name}`" for name in difference.names)
        rows.append(f"| {names} | {difference.kind.value} | {difference.reason} |")
    return "\n".join(rows)


if __name__ == "__main__":
    print(as_markdown())

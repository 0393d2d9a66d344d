"""The deliberate differences of the Python API, with explanations: one table for test and documentation.

Names are patterns of full names, `module.Name` or `module.Class.member`, in which `*` matches any characters.
`docs/internals/differences.md` has the same table: `python -m tests.interop.python_api_differences` prints
it.
"""

from dataclasses import dataclass
from enum import Enum


class Kind(Enum):
    """The kind of difference."""

    NAMED = "can only be imported"
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
        "they belong to genuine rospy's transport, and have no function in pipros, whose transport is "
        "`pipros.net`",
        (
            "rospy.*.ConnectionStatisticsLogger", "rospy.*.Poller", "rospy.*.QueuedConnection",
            "rospy.*.ROSHandler", "rospy.*.RegManager", "rospy.*.SubscriberStatisticsLogger",
            "rospy.*.TCPROSHandler", "rospy.*.TCPROSPub", "rospy.*.TCPROSServer",
            "rospy.*.TCPROSServiceClient", "rospy.*.TCPROSSub", "rospy.*.TCPROSTransport",
            "rospy.*.TCPROSTransportProtocol", "rospy.*.TCPServer", "rospy.*.TCPService",
            "rospy.impl.tcpros_pubsub.robust_connect_subscriber",
            "rospy.impl.tcpros_service.service_connection_handler",
        ),
    ),
    Difference(
        Kind.DIFFERS,
        "its parameter is called `str`, as in the message classes that genuine genpy generates",
        ("*.Message.deserialize",),
    ),
    Difference(
        Kind.ABSENT,
        "they generate message code from templates that contain Python code; `catkin_make` generates C++ "
        "headers without them",
        ("genmsg.command_line*", "genmsg.deps*", "genmsg.template_tools*"),
    ),
    Difference(
        Kind.ABSENT,
        "they read and write the manifests of rosbuild and its stacks, which catkin replaced in 2013",
        ("roslib.manifest*", "roslib.stack_manifest*", "roslib.stacks*"),
    ),
    Difference(
        Kind.ABSENT,
        "they implement threads and servers of Noetic's own processes, which pipros does not have; use "
        "`roslaunch.pmon`, `concurrent.futures` or `rosgraph.xmlrpc.XmlRpcNode`",
        (
            "rosgraph.xmlrpc.*XMLRPC*", "rosmaster.threadpool*", "*.MarkedThreadPool", "rosunit.*pmon*",
            "rosunit.baretest.LocalProcess",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they change PyYAML's loaders and dumpers for the whole process; pipros has its own loaders "
        "and dumpers",
        (
            "rosmsg.construct_ordered_mapping", "rosmsg.construct_yaml_map_with_ordered_dict",
            "rosmsg.init_rosmsg_proto", "rosmsg.represent_ordered_mapping",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they write the Python source of message classes; pipros creates the classes without source files",
        (
            "genpy.dynamic.msg_generator", "genpy.generate_numpy.*", "genpy.generate_struct.*",
            "genpy.generate_initpy.*", "genpy.generator.*", "genpy.genpy_main.*",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they implement the genuine master and launcher; use `rosmaster.master.Master` as a master, and the "
        "commands `rosgraph` and `roslaunch` with `--nodes` or `--args`",
        (
            "rosgraph.rosgraph_main*",
            "roslaunch.roslaunch_logs*", "roslaunch.server*", "rosmaster.master_api*",
            "rosmaster.paramserver*", "rosmaster.registrations*", "rosmaster.util*", "rosmaster.validators*",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they are internals of the command `roslaunch-deps`, or have no function in Noetic",
        (
            "roslaunch.depends.calculate_missing", "roslaunch.depends.convert_value",
            "roslaunch.depends.fullusage", "roslaunch.depends.load_mappings",
            "roslaunch.depends.parse_launch", "roslaunch.depends.print_deps",
            "roslaunch.depends.resolve_args", "roslaunch.depends.rl_file_deps",
            "roslib.gentools.compute_md5_v1", "roslib.srvs.*_verbose",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they manage processes that the genuine launcher starts for itself, and no public package was found "
        "that uses them; use `ROSLaunchParent` or `ROSLaunch` to start, watch and stop nodes, and "
        "`subprocess` for other programs",
        (
            "roslaunch.pmon.DeadProcess*",
            "roslaunch.*create_*_process", "roslaunch.*Process.get_exit_description",
            "roslaunch.*Process.should_respawn", "roslaunch.*Process.start",
            "roslaunch.*ProcessMonitor.*main_thread_jobs", "roslaunch.*ProcessMonitor.*register*",
            "roslaunch.*ProcessMonitor.*_list", "roslaunch.*ProcessMonitor.*_procs",
            "roslaunch.*ProcessMonitor.*_signals", "roslaunch.*ProcessMonitor.plock",
            "roslaunch.*Process.lock", "roslaunch.*Process.time_of_death",
        ),
    ),
    Difference(
        Kind.DIFFERS,
        "programs cannot create instances; a launch creates one for each of its nodes",
        ("roslaunch.*LocalProcess",),
    ),
    Difference(
        Kind.ABSENT,
        "they implement the genuine reader of launch files, and pass its results to other machines; use "
        "`XmlLoader` to read files into a `ROSLaunchConfig`",
        (
            "roslaunch.*.Loader*", "roslaunch.loader.load_sysargs_into_context",
            "roslaunch.loader.*process_include_args", "roslaunch.xmlloader.ifunless*",
            "roslaunch.*XmlLoader.*_ATTRS", "roslaunch.*XmlLoader.*_attrs", "roslaunch.*XmlLoader.*",
            "roslaunch.*.to*_xml", "roslaunch.*.xmlattrs", "roslaunch.*.xmltype", "roslaunch.*_child_mode",
            "roslaunch.*rle_wrapper",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they are an older reader of message definitions; `genmsg` has the same functions",
        (
            "roslib.msgs.EXTENDED_BUILTINS", "roslib.msgs.Field*", "roslib.msgs.MsgSpec",
            "roslib.msgs.REGISTERED_TYPES", "roslib.msgs.VERBOSE", "roslib.msgs.*load_*",
            "roslib.msgs.*register*", "roslib.msgs.get_pkg_msg_specs", "roslib.msgs.reinit",
            "roslib.msgs.*_verbose",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they are internals of the command `rosmsg`; use `rosmsgmain` to run the command",
        (
            "rosmsg.RosMsgProto*", "rosmsg.fullusage", "rosmsg.rosmsg_cmd_[!p]*",
            "rosmsg.rosmsg_cmd_package*", "rosmsg.rosmsg_debug", "rosmsg.spec_to_str",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they implement genuine catkin's build and commands; pipros's `catkin_make`, "
        "`catkin_init_workspace` and `catkin_test_results` do not use them",
        (
            "catkin.builder*", "catkin.cmake*", "catkin.init_workspace*", "catkin.package_version*",
            "catkin.terminal_color*", "catkin.test_results*", "catkin.tidy_xml*", "catkin.workspace_vcs*",
        ),
    ),
    Difference(
        Kind.DIFFERS,
        "they are decorated functions; their arguments are the same",
        ("roslib.scriptutil.get_*", "roslib.scriptutil.script_resolve_name"),
    ),
    Difference(
        Kind.DIFFERS,
        "they are raised and caught as in Noetic, but in pipros, the class or its base class has another "
        "name",
        (
            "*.ArgException", "*.FatalProcessLaunch", "*.NodeParamsException", "*.RLException",
            "*.SubstitutionException",
            "roslaunch.launch.RLTestTimeoutException", "roslaunch.loader.LoadException",
            "roslaunch.*XmlParseException",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they implement the child processes of genuine roslaunch on other machines; pipros starts each node "
        "on another machine through ssh, and `roslaunch --child` runs `pipros_tools.launch.child`",
        (
            "roslaunch.child*", "roslaunch.remote.*", "roslaunch.remoteprocess.*",
            "roslaunch.*ChildROSLaunchProcess*",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "they are internals of the genuine launchers, or names that modules import for internal use",
        (
            "roslaunch.loader.rosparam", "rostest.runner.rostestRunner", "rosunit.*.python2",
            "rosunit.junitxml.RE_XML_ILLEGAL", "rosunit.junitxml.invalid_chars", "rosunit.junitxml.pattern",
        ),
    ),
    Difference(
        Kind.DIFFERS,
        "it is the `Master` of `roslaunch.core`; the launch of a test starts the test's master",
        ("rostest.rostest_parent.Master",),
    ),
    Difference(
        Kind.DIFFERS,
        "they are inherited from Python's `unittest`",
        ("rosunit.*.BareTestCase.setUp", "rosunit.*.BareTestCase.tearDown"),
    ),
    Difference(
        Kind.ABSENT,
        "they are internals of the command `roswtf`, which runs the checks of `pipros doctor`; plugins "
        "can add rules with `roswtf.rules`, and get a `roswtf.context.WtfContext`",
        (
            "roswtf.environment*", "roswtf.graph*", "roswtf.network*", "roswtf.packages*", "roswtf.plugins*",
            "roswtf.py_pip_deb_checks*", "roswtf.rosdep_db*", "roswtf.roslaunchwtf*", "roswtf.stacks*",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "it is an internal class of `rosconsole echo`; use the options of the command",
        ("rospy.rosconsole.RosConsoleEcho*",),
    ),
    Difference(
        Kind.DIFFERS,
        "it is an attribute that the constructor sets, not a method",
        ("rospy.*Service.error_handler", "rospy.*ServiceImpl.error_handler"),
    ),
    Difference(
        Kind.ABSENT,
        "they are internal methods and state of classes that pipros implements differently",
        (
            "actionlib.*INVALID_TRANSITION", "actionlib.*NO_TRANSITION", "actionlib.*g_goal_id",
            "actionlib.*CommStateMachine.set_state", "actionlib.*CommStateMachine.transition_to",
            "actionlib.*SimpleActionServer.terminate_mutex", "actionlib.goal_id_generator.s_goalcount*",
            "actionlib.nop_cb", "actionlib.simple_action_server.nop_cb", "bondpy.BondSM_sm.*",
            "bondpy.bondpy.Bond.[A-Z]*", "bondpy.bondpy.Bond.*_timer", "bondpy.bondpy.Bond.condition",
            "bondpy.bondpy.Bond.deadline", "bondpy.bondpy.Bond.lock", "bondpy.bondpy.Bond.pending_callbacks",
            "bondpy.bondpy.Bond.pub", "bondpy.bondpy.Bond.sub", "bondpy.bondpy.Bond.thread",
            "bondpy.bondpy.Timeout.deadline", "bondpy.bondpy.Timeout.left", "bondpy.bondpy.Timeout.timer",
            "diagnostic_updater.FrequencyStatus.count", "diagnostic_updater.FrequencyStatus.hist_indx",
            "diagnostic_updater.FrequencyStatus.seq_nums", "diagnostic_updater.FrequencyStatus.times",
            "diagnostic_updater.TimeStampStatus.*_count", "diagnostic_updater.TimeStampStatus.*_delta",
            "diagnostic_updater.TimeStampStatus.deltas_valid", "diagnostic_updater.TimeStampStatus.zero_seen",
            "interactive_markers.*InteractiveMarkerServer.doSetPose",
            "interactive_markers.*MarkerContext.last_feedback", "interactive_markers.*MenuHandler.doInsert",
            "interactive_markers.*MenuHandler.makeEntry", "interactive_markers.*MenuHandler.pushMenuEntries",
            "message_filters.*TimeSynchronizer.last_added", "message_filters.*TimeSynchronizer.latest_stamps",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "in Noetic, it is a function that returns None, by mistake: a class was intended",
        ("actionlib_tools.library.YAMLBag",),
    ),
    Difference(
        Kind.ABSENT,
        "they generate source files in a build; pipros reads `.cfg` files without a build",
        (
            "dynamic_reconfigure.parameter_generator*.LINEDEBUG",
            "dynamic_reconfigure.parameter_generator*.ParameterGenerator.*",
            "dynamic_reconfigure.parameter_generator*.check_*",
            "dynamic_reconfigure.parameter_generator*.id",
        ),
    ),
    Difference(
        Kind.ABSENT,
        "it reads a key that no configuration description contains",
        ("dynamic_reconfigure.encoding.get_parents",),
    ),
    Difference(
        Kind.DIFFERS,
        "it is a dictionary, and accepts the arguments of Python's `dict`",
        ("dynamic_reconfigure.encoding.Config",),
    ),
    Difference(
        Kind.ABSENT,
        "they implement migration rules as Python classes; `pipros_tools.bag.migration` parses and "
        "interprets the rules instead",
        ("rosbag.migration.*", "rosbag.rosbag_main.MessageMigrator.*"),
    ),
    Difference(
        Kind.ABSENT,
        "they are internals of the command `rosbag`, or names that modules define for internal use",
        (
            "rosbag.rosbag_main.*_op", "rosbag.rosbag_main.handle_*", "rosbag.rosbag_main.print_trans",
            "rosbag.rosbag_main.ProgressMeter", "rosbag.rosbag_main.RosbagCmds", "rosbag.bag.ComparableMixin",
            "rosbag.bag.found_lz4", "diagnostic_analysis.sparse.PKG",
        ),
    ),
]  # fmt: skip


def as_markdown() -> str:
    """Return the table for the documentation, in Markdown."""
    rows = ["| names | difference | explanation |", "| --- | --- | --- |"]
    for difference in DIFFERENCES:
        names = ", ".join(f"`{name}`" for name in difference.names)
        rows.append(f"| {names} | {difference.kind.value} | {difference.reason} |")
    return "\n".join(rows)


if __name__ == "__main__":
    print(as_markdown())

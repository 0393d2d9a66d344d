"""The server side of the page's tabs: views and actions, some of which change the system.

The action `about` sends `CHANGING`, `CONTROLS` and `OF_MESSAGES` to the browser. If a browser has opened a
bag, its views and actions in `OF_MESSAGES` show the bag; all other views and actions show the running system.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MethodType
from typing import Any

from pipros_page.bags.folder import BagFolder
from pipros_page.bags.open_bags import OpenBags
from pipros_page.bags.recording import BagRecording
from pipros_page.scene.layout_file import SceneFile
from pipros_page.views.actions import ActionViews
from pipros_page.views.acts import ActViews
from pipros_page.views.bags import BagViews
from pipros_page.views.calls import CallViews
from pipros_page.views.checks import CheckViews
from pipros_page.views.console import ConsoleViews
from pipros_page.views.content import ContentViews
from pipros_page.views.diagnostics import DiagnosticViews
from pipros_page.views.frames import FrameViews
from pipros_page.views.graph import GraphViews
from pipros_page.views.images import ImageViews
from pipros_page.views.launches import LaunchViews
from pipros_page.views.layouts import LayoutActions
from pipros_page.views.notices import NoticeViews
from pipros_page.views.params import ParamViews
from pipros_page.views.plot import PlotViews
from pipros_page.views.processes import ProcessViews
from pipros_page.views.reconfigure import ReconfigureViews
from pipros_page.views.recording import RecordingViews
from pipros_page.views.rewind import RewindViews
from pipros_page.views.scene import SceneViews
from pipros_page.views.teleop import TeleopViews
from pipros_page.views.topics import TopicViews
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import ServedViews

Method = Callable[..., Any]


@dataclass(frozen=True, slots=True)
class PageContext:
    """The objects and options from which views are created.

    Attributes:
        system: the running system, or a bag that is played.
        scene_file: the file shown in the Scene tab.
        saves_layouts: whether browsers may store layouts of panels, and notes beside bags.
        bags: the folder whose bags browsers may open.
        recording: writes to `bags`.
        open_bags: the bags that browsers have opened.
    """

    system: WatchedSystem
    scene_file: SceneFile | None = None
    saves_layouts: bool = False
    bags: BagFolder | None = None
    recording: BagRecording | None = None
    open_bags: OpenBags = field(default_factory=OpenBags)


@dataclass(frozen=True, slots=True)
class Tab:
    """The views and actions of one tab, which are methods of one object.

    Attributes:
        make: creates the object.
        views, actions: its methods, by the names that browsers use.
        changing: the views and actions that change the system, with their effects, such as `send goals`.
        of_messages: the views and actions that show messages, either of the system or of a bag.
        controls: the view or action in `changing` that the tab's controls use, by the tab's name on the page.
    """

    make: Callable[[PageContext], Any]
    views: Mapping[str, Method] = field(default_factory=dict)
    actions: Mapping[str, Method] = field(default_factory=dict)
    changing: Mapping[str, str] = field(default_factory=dict)
    of_messages: frozenset[str] = frozenset()
    controls: Mapping[str, str] = field(default_factory=dict)


TABS = (
    Tab(
        lambda context: ActViews(context.system),
        {"acts": ActViews.acts},
        {"approve": ActViews.approve},
        changing={"approve": "approve acts of assistants"},
        controls={"acts": "approve"},
    ),
    Tab(
        lambda context: ActionViews(context.system),
        {"action": ActionViews.action, "actions": ActionViews.actions},
        {"cancel_goal": ActionViews.cancel_goal, "send_goal": ActionViews.send_goal},
        changing={"cancel_goal": "cancel goals", "send_goal": "send goals"},
        controls={"actions": "send_goal"},
    ),
    Tab(
        lambda context: BagViews(
            context.system, context.bags, context.open_bags, may_note=context.saves_layouts
        ),
        {
            "bag": BagViews.bag,
            "bag_curve": BagViews.bag_curve,
            "bag_events": BagViews.bag_events,
            "bag_export": BagViews.bag_export,
            "bag_marks": BagViews.bag_marks,
            "bag_thumbnails": BagViews.bag_thumbnails,
            "bags": BagViews.bags,
        },
        {
            "add_note": BagViews.add_note,
            "bag_control": BagViews.bag_control,
            "remove_note": BagViews.remove_note,
        },
    ),
    Tab(
        lambda context: CallViews(context.system),
        {"publishing": CallViews.publishing, "services": CallViews.services},
        {"call_service": CallViews.call_service, "message": CallViews.message, "service": CallViews.service},
        changing={"call_service": "call services", "publishing": "publish messages"},
        controls={"publish": "publishing", "services": "call_service"},
    ),
    Tab(lambda context: CheckViews(context.system), actions={"why_no_data": CheckViews.why_no_data}),
    Tab(
        lambda context: ConsoleViews(context.system),
        {"console": ConsoleViews.console},
        {"loggers": ConsoleViews.loggers, "set_logger_level": ConsoleViews.set_logger_level},
        changing={"set_logger_level": "set logger levels"},
        of_messages=frozenset({"console"}),
        controls={"console": "set_logger_level"},
    ),
    Tab(
        lambda context: ContentViews(context.system, has_bags=context.bags is not None),
        {"content": ContentViews.content},
    ),
    Tab(
        lambda context: DiagnosticViews(context.system),
        {"diagnostics": DiagnosticViews.diagnostics},
        of_messages=frozenset({"diagnostics"}),
    ),
    Tab(
        lambda context: FrameViews(context.system),
        {"frames": FrameViews.frames, "transform": FrameViews.transform},
        of_messages=frozenset({"frames", "transform"}),
    ),
    Tab(
        lambda context: GraphViews(context.system),
        {
            "events": GraphViews.events,
            "graph": GraphViews.graph,
            "master": GraphViews.master,
            "node": GraphViews.node,
        },
        {"kill_node": GraphViews.kill_node, "picture": GraphViews.picture},
        changing={"kill_node": "end nodes"},
    ),
    Tab(
        lambda context: ImageViews(context.system),
        {
            "image": ImageViews.image,
            "image_overlay": ImageViews.image_overlay,
            "image_pair": ImageViews.image_pair,
        },
        of_messages=frozenset({"image", "image_overlay", "image_pair"}),
    ),
    Tab(
        lambda context: LaunchViews(context.system),
        {"launch_output": LaunchViews.launch_output, "launches": LaunchViews.launches},
        {"restart_launched": LaunchViews.restart_launched, "stop_launched": LaunchViews.stop_launched},
        changing={"restart_launched": "restart nodes", "stop_launched": "stop nodes"},
    ),
    Tab(
        lambda context: LayoutActions(context.system, may_save=context.saves_layouts),
        actions={
            "delete_layout": LayoutActions.delete_layout,
            "layout": LayoutActions.layout,
            "layouts": LayoutActions.layouts,
            "save_layout": LayoutActions.save_layout,
        },
    ),
    Tab(lambda context: NoticeViews(context.system), {"notices": NoticeViews.notices}),
    Tab(
        lambda context: ParamViews(context.system),
        {"params": ParamViews.params},
        {"delete_param": ParamViews.delete_param, "set_param": ParamViews.set_param},
        changing={"delete_param": "delete parameters", "set_param": "set parameters"},
        controls={"params": "set_param"},
    ),
    Tab(
        lambda context: PlotViews(context.system),
        {"log_marks": PlotViews.log_marks, "plot": PlotViews.plot},
        of_messages=frozenset({"log_marks", "plot"}),
    ),
    Tab(lambda context: ProcessViews(context.system), {"processes": ProcessViews.processes}),
    Tab(
        lambda context: ReconfigureViews(context.system),
        {"reconfigurable": ReconfigureViews.reconfigurable, "reconfigure": ReconfigureViews.reconfigure},
        {"set_reconfigured": ReconfigureViews.set_reconfigured},
        changing={"set_reconfigured": "reconfigure nodes"},
        controls={"reconfigure": "set_reconfigured"},
    ),
    Tab(
        lambda context: RecordingViews(context.system, context.recording),
        {"recording": RecordingViews.recording},
        {"record": RecordingViews.record, "stop_recording": RecordingViews.stop_recording},
        changing={"record": "record bags", "stop_recording": "record bags"},
    ),
    Tab(lambda context: RewindViews(context.system), {"rewind": RewindViews.rewind}),
    Tab(
        lambda context: SceneViews(context.system, context.scene_file),
        {
            "scene_cloud": SceneViews.cloud,
            "scene_config": SceneViews.config,
            "scene_messages": SceneViews.messages,
            "scene_resource": SceneViews.resource,
            "scene_robot": SceneViews.robot,
        },
        {"scene_feedback": SceneViews.feedback, "scene_save": SceneViews.save},
        changing={"scene_feedback": "move interactive markers", "scene_save": "save scenes"},
        of_messages=frozenset(f"scene_{name}" for name in ("cloud", "messages")),
    ),
    Tab(
        lambda context: TeleopViews(context.system),
        {"teleop": TeleopViews.teleop},
        {"steer": TeleopViews.steer},
        changing={"steer": "steer robots", "teleop": "steer robots"},
        controls={"teleop": "teleop"},
    ),
    Tab(
        lambda context: TopicViews(context.system),
        {
            "measured": TopicViews.measured,
            "running_topics": TopicViews.topics,  # always the topics of the running system
            "topic": TopicViews.topic,
            "topics": TopicViews.topics,
        },
        {"definition": TopicViews.definition, "message_text": TopicViews.message_text},
        of_messages=frozenset({"definition", "measured", "message_text", "topic", "topics"}),
    ),
)

CHANGING: Mapping[str, str] = {name: what for tab in TABS for name, what in tab.changing.items()}
"""The views and actions that change the system, with their effects."""

BY_POLICY = frozenset(
    (
        "call_service",
        "cancel_goal",
        "publishing",
        "scene_feedback",
        "send_goal",
        "set_param",
        "steer",
        "teleop",
    )
)
"""The part of `CHANGING` that a policy can allow. With a policy, the others are not permitted."""

OF_MESSAGES = frozenset[str]().union(*(tab.of_messages for tab in TABS))
"""The views and actions that show messages of the system or of a bag."""

CONTROLS: Mapping[str, str] = {name: change for tab in TABS for name, change in tab.controls.items()}
"""For tabs of the page, by name, the view or action in `CHANGING` that the tab's controls use."""


def views_of_tabs(context: PageContext, *, only_messages: bool = False) -> ServedViews:
    """Create the objects of the tabs, and return their views and actions.

    If `only_messages` is true, return only the views and actions in `of_messages`.
    """
    views: dict[str, Any] = {}
    actions: dict[str, Any] = {}
    for tab in TABS:
        if only_messages and not tab.of_messages:
            continue
        made = tab.make(context)
        for methods, found in ((tab.views, views), (tab.actions, actions)):
            for name, method in methods.items():
                if not only_messages or name in tab.of_messages:
                    found[name] = MethodType(method, made)
    return ServedViews(views, actions)

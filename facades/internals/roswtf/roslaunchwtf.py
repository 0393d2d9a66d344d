"""Rules about launch files and launchers. Facade of `pipros.health.wtf.launch`."""

from __future__ import annotations

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf import launch as _rules
from roswtf.context import WtfContext
from roswtf.rules import apply, of_context, of_contexts

__all__ = [
    "online_roslaunch_errors",
    "online_roslaunch_warnings",
    "roslaunch_config_errors",
    "roslaunch_dead_check",
    "roslaunch_duplicate_node_check",
    "roslaunch_machine_name_check",
    "roslaunch_missing_node_check",
    "roslaunch_missing_pkgs_check",
    "roslaunch_respawn_check",
    "static_roslaunch_errors",
    "static_roslaunch_warnings",
    "wtf_check_online",
    "wtf_check_static",
]

_star_names(
    __name__,
    "roswtf.rules:error_rule roswtf.environment:is_executable genericpath:isdir genericpath:isfile "
    "itertools os roswtf.environment:paths roslaunch roslib xmlrpc.client:ServerProxy socket stat sys "
    "roswtf.rules:warning_rule",
)

roslaunch_config_errors = of_context(_rules.roslaunch_config_errors)
roslaunch_dead_check = of_context(_rules.roslaunch_dead_check)
roslaunch_duplicate_node_check = of_context(_rules.roslaunch_duplicate_node_check)
roslaunch_machine_name_check = of_context(_rules.roslaunch_machine_name_check)
roslaunch_missing_node_check = of_context(_rules.roslaunch_missing_node_check)
roslaunch_missing_pkgs_check = of_context(_rules.roslaunch_missing_pkgs_check)
roslaunch_respawn_check = of_context(_rules.roslaunch_respawn_check)

online_roslaunch_errors = of_contexts(_rules.online_roslaunch_errors)
online_roslaunch_warnings = of_contexts(_rules.online_roslaunch_warnings)
static_roslaunch_errors = of_contexts(_rules.static_roslaunch_errors)
static_roslaunch_warnings = of_contexts(_rules.static_roslaunch_warnings)


def wtf_check_static(ctx: WtfContext) -> None:
    """Apply the rules about launch files, if there are files to check."""
    if ctx.launch_files:
        apply(ctx, static_roslaunch_warnings, static_roslaunch_errors)


def wtf_check_online(ctx: WtfContext) -> None:
    """Apply the rules about running launchers."""
    apply(ctx, online_roslaunch_warnings, online_roslaunch_errors)

"""Rules about launch files and launchers. Facade of `pipros.health.wtf.roslaunchwtf`."""

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf.roslaunchwtf import (
    online_roslaunch_errors,
    online_roslaunch_warnings,
    roslaunch_config_errors,
    roslaunch_dead_check,
    roslaunch_duplicate_node_check,
    roslaunch_machine_name_check,
    roslaunch_missing_node_check,
    roslaunch_missing_pkgs_check,
    roslaunch_respawn_check,
    static_roslaunch_errors,
    static_roslaunch_warnings,
    wtf_check_online,
    wtf_check_static,
)

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

"""`catkin.package_version`: package versions and change logs, implemented by catkin_pkg."""

from catkin_pkg.changelog_generator import FORTHCOMING_LABEL as FORTHCOMING_LABEL
from catkin_pkg.package_version import bump_version as bump_version
from catkin_pkg.package_version import get_forthcoming_label as get_forthcoming_label
from catkin_pkg.package_version import update_changelog_sections as update_changelog_sections
from catkin_pkg.package_version import update_versions as update_versions

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "datetime docutils os re catkin_pkg.package_version:rename_section")

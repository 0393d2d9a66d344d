"""The case study: the package that a student makes, and what is changed in its generated files."""

from __future__ import annotations

from typing import Final

from tests.support.environments import REPOSITORY

EXAMPLE: Final = REPOSITORY / "examples/catkin_ws/src/composiv_tryouts"
WORKSPACE: Final = "feature/buse_nur_emir_07042023/catkin_ws"

CMAKE_CHANGES: Final = {
    "  rospy\n)": "  rospy\n  message_generation\n)",
    "# add_message_files(": "add_message_files(FILES BatteryLevel.msg)\n# add_message_files(",
    "# generate_messages(": "generate_messages()\n# generate_messages(",
    "catkin_package(": "catkin_package(CATKIN_DEPENDS message_runtime",
}
"""Figure 3, as replacements in CMakeLists.txt."""

MANIFEST_CHANGES: Final = {
    "</build_depend>\n": "</build_depend>\n  <build_depend>message_generation</build_depend>\n",
    "</exec_depend>\n": "</exec_depend>\n  <exec_depend>message_runtime</exec_depend>\n",
}
"""Figure 4, as replacements in package.xml."""

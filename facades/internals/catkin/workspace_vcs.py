"""`catkin.workspace_vcs`: version control of a source folder, implemented by catkin_pkg."""

from catkin_pkg.workspace_vcs import get_repository_type as get_repository_type
from catkin_pkg.workspace_vcs import vcs_remotes as vcs_remotes

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "os subprocess")

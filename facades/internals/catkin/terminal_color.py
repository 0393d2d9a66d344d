"""`catkin.terminal_color`: coloured text on a terminal, implemented by catkin_pkg."""

from catkin_pkg.terminal_color import ColorTemplate as ColorTemplate
from catkin_pkg.terminal_color import ansi as ansi
from catkin_pkg.terminal_color import disable_ANSI_colors as disable_ANSI_colors
from catkin_pkg.terminal_color import enable_ANSI_colors as enable_ANSI_colors
from catkin_pkg.terminal_color import fmt as fmt
from catkin_pkg.terminal_color import sanitize as sanitize

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "os string")

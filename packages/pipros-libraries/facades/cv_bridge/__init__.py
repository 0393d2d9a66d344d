"""Drop-in replacement for Noetic's cv_bridge, with numpy: convert between image messages and arrays."""

from cv_bridge.boost.cv_bridge_boost import cvtColor2 as cvtColor2
from cv_bridge.boost.cv_bridge_boost import cvtColorForDisplay as cvtColorForDisplay
from cv_bridge.boost.cv_bridge_boost import getCvType as getCvType
from cv_bridge.core import CvBridge as CvBridge
from cv_bridge.core import CvBridgeError as CvBridgeError
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, hidden="cvtColor2")

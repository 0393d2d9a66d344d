"""Drop-in replacement for Noetic's actionlib: long-running goals with feedback, results and cancellation."""

from actionlib_msgs.msg import GoalID as GoalID
from actionlib_msgs.msg import GoalStatus as GoalStatus
from actionlib_msgs.msg import GoalStatusArray as GoalStatusArray
from std_msgs.msg import Header as Header

from actionlib.action_client import ActionClient as ActionClient
from actionlib.action_client import ClientGoalHandle as ClientGoalHandle
from actionlib.action_client import CommState as CommState
from actionlib.action_client import CommStateMachine as CommStateMachine
from actionlib.action_client import GoalManager as GoalManager
from actionlib.action_client import TerminalState as TerminalState
from actionlib.action_client import get_name_of_constant as get_name_of_constant
from actionlib.action_server import ActionServer as ActionServer
from actionlib.exceptions import ActionException as ActionException
from actionlib.goal_id_generator import GoalIDGenerator as GoalIDGenerator
from actionlib.handle_tracker_deleter import HandleTrackerDeleter as HandleTrackerDeleter
from actionlib.server_goal_handle import ServerGoalHandle as ServerGoalHandle
from actionlib.simple_action_client import SimpleActionClient as SimpleActionClient
from actionlib.simple_action_client import SimpleGoalState as SimpleGoalState
from actionlib.simple_action_server import SimpleActionServer as SimpleActionServer
from actionlib.status_tracker import StatusTracker as StatusTracker
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "rospy threading time traceback weakref", hidden="action_types")

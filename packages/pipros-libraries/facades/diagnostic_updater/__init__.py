"""Drop-in replacement for Noetic's diagnostic_updater: publish a device's state on /diagnostics."""

from diagnostic_msgs.msg import DiagnosticArray as DiagnosticArray
from diagnostic_msgs.msg import DiagnosticStatus as DiagnosticStatus
from diagnostic_msgs.msg import KeyValue as KeyValue

from diagnostic_updater.publisher import DiagnosedPublisher as DiagnosedPublisher
from diagnostic_updater.publisher import HeaderlessTopicDiagnostic as HeaderlessTopicDiagnostic
from diagnostic_updater.publisher import TopicDiagnostic as TopicDiagnostic
from diagnostic_updater.status import ERROR as ERROR
from diagnostic_updater.status import OK as OK
from diagnostic_updater.status import WARN as WARN
from diagnostic_updater.status import DiagnosticStatusWrapper as DiagnosticStatusWrapper
from diagnostic_updater.tasks import CompositeDiagnosticTask as CompositeDiagnosticTask
from diagnostic_updater.tasks import DiagnosticTask as DiagnosticTask
from diagnostic_updater.tasks import FrequencyStatus as FrequencyStatus
from diagnostic_updater.tasks import FrequencyStatusParam as FrequencyStatusParam
from diagnostic_updater.tasks import FunctionDiagnosticTask as FunctionDiagnosticTask
from diagnostic_updater.tasks import Heartbeat as Heartbeat
from diagnostic_updater.tasks import TimeStampStatus as TimeStampStatus
from diagnostic_updater.tasks import TimeStampStatusParam as TimeStampStatusParam
from diagnostic_updater.updater import DiagnosticTaskVector as DiagnosticTaskVector
from diagnostic_updater.updater import Updater as Updater
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "httplib=http.client rospy threading", hidden="publisher status tasks updater")

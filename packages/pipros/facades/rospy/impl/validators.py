"""`rospy.impl.validators`: argument checks."""

from pipros.net.argument_checks import ParameterInvalid, non_empty

__all__ = ["ParameterInvalid", "non_empty"]

"""Where genuine rospy keeps its inner parts. Names that others import from there are found here."""

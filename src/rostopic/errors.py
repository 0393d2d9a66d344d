"""The exceptions of rostopic."""


class ROSTopicException(Exception):
    """A rostopic function failed."""


class ROSTopicIOException(ROSTopicException):
    """The master does not answer."""

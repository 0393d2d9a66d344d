"""Exceptions of rostopic."""


class ROSTopicException(Exception):
    """A rostopic function failed."""


class ROSTopicIOException(ROSTopicException):
    """The master cannot be reached."""

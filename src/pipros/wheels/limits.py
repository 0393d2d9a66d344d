"""The limits of wheels."""

from typing import NamedTuple


class WheelLimits(NamedTuple):
    """The limits of wheels: `limits.of(WheelLimits)` for a `Limits`.

    Attributes:
        wheel_bytes: the files of one package's wheel, together.
        wheel_repositories: the repositories that one `.rosinstall` or `.repos` file lists.
    """

    wheel_bytes: int = 2 * 1024 * 1024 * 1024
    wheel_repositories: int = 500

"""Limits on wheels and on lists of repositories."""

from typing import NamedTuple


class WheelLimits(NamedTuple):
    """Limits on wheels and on lists of repositories.

    Get them with `limits.of(WheelLimits)`, where `limits` is a `Limits`.

    Attributes:
        wheel_bytes: maximum total size of the files in one package's wheel.
        wheel_repositories: maximum number of repositories in one `.rosinstall` or `.repos` file.
    """

    wheel_bytes: int = 2 * 1024 * 1024 * 1024
    wheel_repositories: int = 500

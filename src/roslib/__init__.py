"""`roslib`, for old scripts: `load_manifest` has nothing to do, as packages are found by themselves."""

__all__ = ["load_manifest"]


def load_manifest(package_name: str, bootstrap_version: str = "0.7") -> None:
    """Made a package's Python modules importable in rosbuild times; they are without it."""

"""Find the folders of ROS packages. xacro 2 imports this module as `ament_index_python.packages`."""

from __future__ import annotations

from pipros.packages import ImportablePackages


class PackageNotFoundError(LookupError):
    """No package has this name."""


def get_package_share_directory(package_name: str) -> str:
    """Return the folder of a package, with the precedence of `ImportablePackages.find`.

    Raises:
        PackageNotFoundError: there is no package with this name.
    """
    found = ImportablePackages().find(package_name)
    if found is None:
        raise PackageNotFoundError(
            f"there is no package {package_name}. Is its folder on ROS_PACKAGE_PATH, or did you forget to "
            "source devel/setup.bash?"
        )
    return found

"""Import `<package>.msg` and `<package>.srv` directly from definition files.

Three finders work together. `PackageFinder` is last in `sys.meta_path`: it finds the ROS package `my_pkg` if
no other finder finds a module of that name. `InterfaceFinder` is first, and finds only `my_pkg.msg` and
`my_pkg.srv`. Without it, a folder `my_pkg/msg` with definitions below the working directory would be taken
for a Python namespace package. Real Python packages, such as those that catkin generates in a devel space,
take precedence, with one exception: `WorkspaceFinder`, which is second, prefers a Python package in the
workspace to a distribution of the same name that pip or apt installed, such as `xacro`, and to a wheel of the
same ROS package.

`modules.py` creates the modules when the first type is needed. Every interpreter start imports this module,
so it imports very little.
"""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False  # Type checkers treat this as True. Importing `typing` would take milliseconds.
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

    from pipros.msg.importing.library import Library
    from pipros.msg.language.definition_files import FindPackage
    from pipros.packages import ImportablePackages

KINDS = ("msg", "srv")
NEVER_PACKAGES = frozenset(("pipros", "sitecustomize", "usercustomize", "org", "java"))
"""`pipros`, and names that Python's own modules try to import, mostly without success."""

PACKAGE_OF_MODULE = {"urdf_parser_py": "urdfdom_py"}
"""Noetic's Python packages that belong to a ROS package with another name and are available on PyPI."""

DEPENDENCIES = frozenset(
    (
        *("bson", "catkin_pkg", "cbor2", "cryptography", "cv2", "em", "lz4", "mcap", "numpy", "pil"),
        *(
            "pkg_resources",
            "psutil",
            "pymongo",
            "rospkg",
            "setuptools",
            "websockets",
            "xxhash",
            "yaml",
            "zenoh",
        ),
    )
)
"""Modules that pipros's own commands import, in lower case. The workspace is not searched for these."""


def install() -> None:
    """Enable imports of the packages that `ImportablePackages` finds. Further calls have no effect."""
    if not any(isinstance(finder, InterfaceFinder) for finder in sys.meta_path):
        packages = _Packages()
        sys.meta_path.insert(0, InterfaceFinder(packages.find, packages.cache_folder))
        sys.meta_path.insert(1, WorkspaceFinder(packages.find_in_workspace, packages.find_hiding))
        ros1 = PackageFinder(packages.find, packages.find_module)
        sys.meta_path.append(ros1)
        if is_beside_ros2():
            from pipros.msg.importing.beside_ros2 import Ros2Finder

            sys.meta_path.insert(0, Ros2Finder(ros1.find_spec))


def is_beside_ros2() -> bool:
    """Return whether this environment also contains ROS 2."""
    return "AMENT_PREFIX_PATH" in os.environ or os.path.isdir(os.path.join(sys.prefix, "share/ament_index"))


def installed_library() -> Library:
    """Return the types that can be imported. Install the hook if `pipros.pth` has not done so."""
    install()
    return next(finder.library for finder in sys.meta_path if isinstance(finder, InterfaceFinder))


def give_way(name: str) -> None:
    """Replace a package of messages by the workspace's package of the same name, if there is one.

    Each of pipros's packages of messages calls this function. If no `.pth` file has installed the hook, the
    first one was imported before `WorkspaceFinder` could be asked.
    """
    finder = next(finder for finder in sys.meta_path if isinstance(finder, WorkspaceFinder))
    spec = finder.find_missed(name)
    if spec is not None:
        _become(sys.modules[name], spec)


def _become(module: ModuleType, spec: ModuleSpec) -> None:
    """Turn a module into the package of a spec."""
    module.__path__ = spec.submodule_search_locations or []
    module.__spec__, module.__file__, module.__loader__ = spec, spec.origin, spec.loader
    if spec.loader is not None:
        spec.loader.exec_module(module)


class _Packages:
    """Wrapper that imports `ImportablePackages` only when the first package is searched for."""

    def __init__(self) -> None:
        self._importable: ImportablePackages | None = None

    def find(self, name: str) -> str | None:
        return self._get().find(name)

    def find_module(self, name: str, package: str | None) -> str | None:
        return self._get().find_module(name, package)

    def find_in_workspace(self, name: str, package: str) -> str | None:
        return self._get().find_in_workspace(name, package)

    def find_hiding(self, package: str) -> str | None:
        return self._get().find_hiding(package)

    def _get(self) -> ImportablePackages:
        if self._importable is None:
            from pipros.packages import ImportablePackages

            self._importable = ImportablePackages()
        return self._importable

    def cache_folder(self) -> str:
        from pipros.packages import cache_folder

        return cache_folder("messages")


class PackageFinder:
    """Finder for the Python package of a ROS package.

    If a ROS package has no Python package, only its messages, services and `.cfg` modules can be imported.

    Modules are searched for in `src/` and in the folders listed in `setup.py`, including the `setup.py` of a
    ROS package with a different name. If a well-known module cannot be found, the ImportError names its
    replacement.

    Args:
        find_module: function that takes a name and the folder of the ROS package with that name (None if
            there is none), and returns the path of a module, the folder of a Python package, or None.
    """

    def __init__(
        self,
        find_package: FindPackage,
        find_module: Callable[[str, str | None], str | None] = lambda _name, _package: None,
    ) -> None:
        self._find_package = find_package
        self._find_module = find_module

    def find_spec(
        self, name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if ".cfg" in name and name.split(".")[1] == "cfg":
            from pipros_libraries.reconfigure.modules import cfg_spec

            return cfg_spec(self._find_package, name)
        if "." in name:
            return self._spec_in_hidden_package(name)
        if not _may_be_package(name) or _is_python_starting():
            return None
        if name == "ament_index_python" and "xacro" in sys.modules:
            from pipros.packages import ament_index_python

            return _spec_of(name, os.path.dirname(ament_index_python.__file__))
        found = self._find_package(PACKAGE_OF_MODULE.get(name, name))
        folder = None if found is None else os.fspath(found)
        if folder is not None:
            from pipros.packages import folder_of_modules

            modules = folder_of_modules(name, folder)
            if modules is not None:
                return _spec_of(name, modules)
        path = self._find_module(name, folder)
        if path is not None:
            return _spec_of(name, path)
        if folder is None or not (
            any(os.path.isdir(os.path.join(folder, kind)) for kind in (*KINDS, "action", "cfg"))
            or self.find_spec(f"{name}.cfg") is not None
        ):
            from pipros.packages.absent_modules import absent_spec

            return absent_spec(name)
        return _empty_package_spec(name, folder)

    def _spec_in_hidden_package(self, name: str) -> ModuleSpec | None:
        """Return the spec of a module whose package Python has mistaken for a namespace package.

        If the working directory is `catkin_ws/src`, the ROS package's folder `my_pkg` hides
        `my_pkg/src/my_pkg`. In that case, this function turns the namespace module into the package. In
        Noetic, too, a package further down `sys.path` takes precedence over such a folder.
        """
        package = name.partition(".")[0]
        module = sys.modules.get(package)
        if getattr(module, "__file__", None) is not None or not hasattr(module, "__path__"):
            return None
        spec = self.find_spec(package)
        if module is None or spec is None or spec.loader is None or spec.submodule_search_locations is None:
            return None
        _become(module, spec)
        from importlib.machinery import PathFinder

        return PathFinder.find_spec(name, module.__path__)


_LEVELS = 3
"""Depth below a folder of `ROS_PACKAGE_PATH` to which `WorkspaceFinder` searches for packages."""


class WorkspaceFinder:
    """Finder for Python packages in the workspace that installed distributions would otherwise hide.

    Because this finder is called for every import of an installed module, it searches for packages only if
    a folder in the workspace, or a module in a wheel of a ROS package, has the module's name. The list of
    these names is rebuilt when `ROS_PACKAGE_PATH` has changed.

    A package in the workspace hides all modules of a wheel of the same package, even modules that are
    missing from the workspace.

    Args:
        find_in_workspace: function that takes the names of a module and of a ROS package, and returns the
            path of the module in that package if it is in the workspace, or None.
        find_hiding: function that takes the name of a ROS package, and returns the package's folder if the
            package is in the workspace and hides the package that pip installed, or None.
    """

    def __init__(
        self,
        find_in_workspace: Callable[[str, str], str | None],
        find_hiding: Callable[[str], str | None] = lambda _package: None,
    ) -> None:
        self._find_in_workspace = find_in_workspace
        self._find_hiding = find_hiding
        self._folders: tuple[str, frozenset[str]] = "", frozenset()
        self._wheels: dict[str, str] = {}
        self._may_have_missed = True

    def find_missed(self, name: str) -> ModuleSpec | None:
        """Return what `find_spec` does for the first package that asks; the finder was there for others."""
        may_have_missed, self._may_have_missed = self._may_have_missed, False
        return self.find_spec(name) if may_have_missed else None

    def find_spec(
        self, name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        path = os.environ.get("ROS_PACKAGE_PATH")
        if "." in name or not path or name.lower() in DEPENDENCIES:
            return None
        if not _may_be_package(name) or _is_python_starting():
            return None
        if self._folders[0] != path:
            roots = (root for root in path.split(os.pathsep) if root)
            self._folders = path, frozenset(found for root in roots for found in _folder_names(root, _LEVELS))
            self._wheels = _modules_of_wheels()
        if name in self._wheels:
            return self._instead_of_wheel(name, self._wheels[name])
        package = PACKAGE_OF_MODULE.get(name, name)
        if package not in self._folders[1]:
            return None
        from pipros.msg.importing.installed_modules import may_be_replaced

        if not may_be_replaced(name):
            return None
        found = self._find_in_workspace(name, package)
        return None if found is None else _spec_of(name, found)

    def _instead_of_wheel(self, name: str, package: str) -> ModuleSpec | None:
        """Return the spec of a module in a wheel of `package` if the workspace also has `package`."""
        folder = self._find_hiding(package)
        if folder is None:
            return None
        from pipros.msg.importing.installed_modules import is_outside_site_folders

        if is_outside_site_folders(name):
            return None  # the workspace is built, and its modules come first on `sys.path`
        found = self._find_in_workspace(name, package)
        if found is not None:
            return _spec_of(name, found)
        if name == package:
            return _empty_package_spec(name, folder)
        from pipros.packages.absent_modules import hidden_spec

        return hidden_spec(name, package, folder)


def _modules_of_wheels() -> dict[str, str]:
    """Map each module that was installed by a wheel of a ROS package to that package."""
    marks = (os.path.join(entry, up, "share", "pipros") for entry in sys.path for up in ("", "../../.."))
    if not any(map(os.path.isdir, marks)):
        return {}
    from pipros.packages.installed_packages import modules

    return modules()


def _folder_names(folder: str, levels: int) -> Iterator[str]:
    """Yield the names of a folder and its subfolders, down to `levels`. Skip folders inside packages."""
    yield os.path.basename(folder.rstrip(os.sep))
    if levels == 0 or os.path.isfile(os.path.join(folder, "package.xml")):
        return
    try:
        inside = os.listdir(folder)
    except OSError:
        return
    for path in (os.path.join(folder, name) for name in inside if name[0] != "."):
        if os.path.isdir(path):
            yield from _folder_names(path, levels - 1)


def _empty_package_spec(name: str, folder: str) -> ModuleSpec:
    """Return the spec of a Python package with only messages, services and `.cfg` modules."""
    from importlib.machinery import ModuleSpec

    spec = ModuleSpec(name, None, is_package=True)
    spec.submodule_search_locations = [os.path.join(folder, "src", name)]
    return spec


def _spec_of(name: str, path: str) -> ModuleSpec:
    """Return the spec of the module in a file, or of the package in a folder."""
    from importlib.machinery import ModuleSpec, SourceFileLoader

    # Equivalent to importlib.util.spec_from_file_location(), but importing importlib.util takes
    # milliseconds.
    is_package = not path.endswith(".py")
    file = os.path.join(path, "__init__.py") if is_package else path
    spec = ModuleSpec(name, SourceFileLoader(name, file), origin=file, is_package=is_package)
    spec.has_location = True
    if is_package:
        spec.submodule_search_locations = [path]
    return spec


class InterfaceFinder:
    """Finder for `<package>.msg`, `<package>.srv` and the modules of individual types in them.

    Args:
        cache_folder: function that returns the folder in which compiled types are kept between processes,
            called when the first type is requested; None for no cache.
    """

    def __init__(self, find_package: FindPackage, cache_folder: Callable[[], str] | None) -> None:
        self._find_package = find_package
        self._cache_folder = cache_folder
        self._library: Library | None = None

    @property
    def library(self) -> Library:
        if self._library is None:
            from pipros.msg.importing.library import Library

            folder = None if self._cache_folder is None else self._cache_folder()
            self._library = Library(self._find_package, folder)
        return self._library

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name.startswith("pipros.ros1."):
            from pipros.msg.importing.ros1_modules import ros1_spec

            return ros1_spec(self.library, name)
        package, _, rest = name.partition(".")
        kind, _, type_module = rest.partition(".")
        if kind not in KINDS or (type_module and type_module[0] != "_") or not _may_be_package(package):
            return None
        from pipros.msg.importing.modules import interface_spec, type_spec

        if type_module:
            return type_spec(self.library, package, kind, type_module)
        return interface_spec(self.library, package, kind, path)


def _may_be_package(name: str) -> bool:
    return (
        name.isidentifier()
        and name[0] != "_"
        and name not in NEVER_PACKAGES
        and name not in sys.stdlib_module_names
    )


def _is_python_starting() -> bool:
    """Return True while Python runs `sitecustomize` or `usercustomize`.

    These modules often try to import modules that do not exist. For example, on Debian and Ubuntu,
    `sitecustomize` tries to import the crash reporter whenever Python starts. Searching for a ROS package of
    that name would take longer than the rest of Python's startup.
    """
    for name in ("sitecustomize", "usercustomize"):
        spec = getattr(sys.modules.get(name), "__spec__", None)
        if getattr(spec, "_initializing", False):  # importlib marks modules in this way
            return True
    return False

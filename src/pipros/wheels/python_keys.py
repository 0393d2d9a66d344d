"""PyPI projects for rosdep's Python keys that `package.xml` files use.

The table contains the keys in the manifests of pipros's packages and of the examples, and other common keys.
`script/long keys` downloads each project once. A key for Python 2 (`python-yaml`) refers to the same project
as the key for Python 3. An empty project means that the modules come with Python or pipros.
"""

from __future__ import annotations

from collections.abc import Mapping

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_file
from pipros.safe import yaml
from pipros.wheels.names import is_requirement

_PROJECTS = {
    "argcomplete": "argcomplete",
    "autobahn": "autobahn",
    "boto3": "boto3",
    "bson": "pymongo",
    "catkin-pkg": "catkin_pkg",
    "cbor2": "cbor2",
    "coverage": "coverage",
    "cryptography": "cryptography",
    "dateutil": "python-dateutil",
    "defusedxml": "defusedxml",
    "deprecated": "Deprecated",
    "docopt": "docopt",
    "empy": "empy<4",
    "flask": "Flask",
    "future": "future",
    "imageio": "imageio",
    "jinja2": "Jinja2",
    "jsonschema": "jsonschema",
    "lxml": "lxml",
    "matplotlib": "matplotlib",
    "mock": "mock",
    "msgpack": "msgpack",
    "networkx": "networkx",
    "numpy": "numpy",
    "opencv": "opencv-python-headless<5",
    "packaging": "packaging",
    "paho-mqtt": "paho-mqtt",
    "pandas": "pandas",
    "paramiko": "paramiko",
    "pexpect": "pexpect",
    "pil": "pillow",
    "pillow": "pillow",
    "imaging": "pillow",
    "protobuf": "protobuf",
    "psutil": "psutil",
    "pycryptodome": "pycryptodomex",
    "pydot": "pydot",
    "pygame": "pygame",
    "pymodbus": "pymodbus",
    "pymongo": "pymongo",
    "pyproj": "pyproj",
    "pytest": "pytest",
    "redis": "redis",
    "requests": "requests",
    "rospkg": "",
    "ruamel.yaml": "ruamel.yaml",
    "scipy": "scipy",
    "semver": "semver",
    "serial": "pyserial",
    "setuptools": "setuptools<82",
    "shapely": "shapely",
    "simplejson": "simplejson",
    "six": "six",
    "skimage": "scikit-image",
    "sklearn": "scikit-learn",
    "sympy": "sympy",
    "tabulate": "tabulate",
    "termcolor": "termcolor",
    "toml": "toml",
    "tornado": "tornado",
    "tqdm": "tqdm",
    "twisted": "Twisted",
    "typing": "",
    "enum34": "",
    "argparse": "",
    "urllib3": "urllib3",
    "usb": "pyusb",
    "websocket": "websocket-client",
    "websockets": "",
    "xmltodict": "xmltodict",
    "yaml": "",
    "zmq": "pyzmq",
}

_OTHER_NAMES = {
    "python3-catkin-pkg-modules": "",
    "python3-catkin-tools": "catkin-tools",
    "python3-distutils": "",
    "python3-rospkg-modules": "",
    "python-rospkg-modules": "",
    "python-catkin-pkg-modules": "",
    "python-opencv": "opencv-python-headless<5",
    "python-scikit-image": "scikit-image",
    "python3-scikit-image": "scikit-image",
    "python3": "",
    "python": "",
    "python3-dev": "",
    "python-dev": "",
    "python3-pip": "",
    "python3-urdfdom-py": "urdf-parser-py",
    "opencv-python": "opencv-python-headless<5",
}


def _table() -> dict[str, str]:
    table = {f"python{version}-{key}": name for key, name in _PROJECTS.items() for version in ("3", "")}
    # Keys that rosdep defines for pip.
    table |= {f"python{v}-{key}-pip": name for key, name in _PROJECTS.items() if name for v in ("3", "")}
    return {**table, **_OTHER_NAMES}


PYTHON_KEYS: Mapping[str, str] = _table()
"""Requirements for pip, by rosdep key."""


class BadPythonKeys(PiprosError):
    """A file with additional keys contains something other than keys and requirements."""


def read_keys(file: str | None) -> Mapping[str, str]:
    """Return `PYTHON_KEYS`, extended or overridden by the keys in a file.

    Args:
        file: a YAML file that maps keys to requirements for pip, such as `my_key: pyserial>=3.5`; None for no
            file.

    Raises:
        BadPythonKeys: the file does not contain such a mapping.
        YamlError, OSError: the file cannot be read.
    """
    if file is None:
        return PYTHON_KEYS
    content = yaml.load_texts(read_file(file), file)
    if not isinstance(content, dict):
        raise BadPythonKeys(f"{file}: expected a mapping from keys to requirements")
    for key, value in content.items():
        if not isinstance(value, str) or (value and not is_requirement(value)):
            raise BadPythonKeys(f"{file}: [{key}] must be a requirement such as pyserial>=3.5, got [{value}]")
    return {**PYTHON_KEYS, **{str(key): value for key, value in content.items()}}

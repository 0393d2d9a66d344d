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
from pipros_wheels.names import is_requirement

_SAME_NAMES = """
    alembic argcomplete autobahn babel bitarray bitstring boto3 cachetools cairosvg catkin-pkg cbor
    cbor2 click colorama colorcet construct coverage crcmod cryptography cython decorator defusedxml
    deprecated dill docker docopt docutils evdev fastapi filterpy flake8 flask flask-cors flask-socketio
    future geographiclib geojson geopandas geopy gevent grpcio h5py httpx humanfriendly hypothesis ifcfg
    imageio influxdb inputs jinja2 joblib jsonpickle jsonschema kitchen lxml mako markdown matplotlib
    mock msgpack mypy natsort netaddr netifaces networkx nose ntplib numba numpy numpy-stl open3d
    packaging paho-mqtt pandas parameterized paramiko parse passlib pathos peewee pep8 pexpect pika
    pillow plotly ply prettytable protobuf psutil pybullet pycodestyle pycollada pydantic pydot
    pyelftools pyftdi pygame pykalman pylint pymap3d pymodbus pymongo pymysql pynmea2 pynput pypng
    pyproj pyqt5 pyqtgraph pyquaternion pyrealsense2 pyro4 pysnmp pytest pytest-cov pytest-mock
    pytest-timeout pyudev pyvista qrcode rdflib redis regex requests requests-oauthlib requests-toolbelt
    rtree ruamel.yaml schedule schema scipy scp seaborn semver shapely simplejson six sounddevice
    soundfile speechrecognition sphinx sqlalchemy statsmodels sympy tables tabulate termcolor texttable
    toml toposort tornado tqdm transforms3d transitions trimesh twisted tzlocal ujson urllib3 utm
    uvicorn vcstool virtualenv voluptuous werkzeug wheel xlrd xlsxwriter xmltodict zeroconf
"""
"""Keys without the prefix `python3-` whose PyPI project has the same name.

A rule for all keys would be a guess: if the project has another name, anyone could register this one.
"""

_PROJECTS = {
    **{name: name for name in _SAME_NAMES.split()},
    "argparse": "",
    "bs4": "beautifulsoup4",
    "bson": "pymongo",
    "can": "python-can",
    "dateutil": "python-dateutil",
    "dotenv": "python-dotenv",
    "empy": "empy<4",
    "enum34": "",
    "git": "GitPython",
    "github": "PyGithub",
    "gitlab": "python-gitlab",
    "gnupg": "python-gnupg",
    "grpc-tools": "grpcio-tools",
    "imaging": "pillow",
    "opencv": "opencv-python-headless<5",
    "pil": "pillow",
    "progressbar": "progressbar2",
    "psycopg2": "psycopg2-binary",
    "pycryptodome": "pycryptodomex",
    "rospkg": "",
    "serial": "pyserial",
    "setuptools": "setuptools<82",
    "skimage": "scikit-image",
    "sklearn": "scikit-learn",
    "typing": "",
    "tz": "pytz",
    "usb": "pyusb",
    "vlc": "python-vlc",
    "websocket": "websocket-client",
    "websockets": "",
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

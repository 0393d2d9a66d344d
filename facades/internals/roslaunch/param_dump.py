"""Output of launch files' parameters as YAML."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.inspect import params_text
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import RLException
from roslaunch.xmlloader import XmlLoader

_star_names(__name__, "roslaunch yaml")


def dump_params(files: Sequence[str]) -> bool:
    """Print the parameters in launch files.

    If a file cannot be read, print an error to stderr and return False.
    """
    config = ROSLaunchConfig()
    loader = XmlLoader()
    for file in files:
        try:
            loader.load(file, config, verbose=False)
        except RLException as error:
            sys.stderr.write(f"Unable to load file {file}: {error}")
            return False
    print(params_text({key: param.value for key, param in config.params.items()}))
    return True

"""Drop-in replacement for Noetic's rosunit; a facade of `pipros.testing`."""

from __future__ import annotations

import importlib
from types import ModuleType

from pipros.basics.lazy_names import star_names as _star_names
from rosunit.baretest import print_runner_summary, print_unittest_summary
from rosunit.core import XML_OUTPUT_FLAG, create_xml_runner, rostest_name_from_path, xml_results_file
from rosunit.pyunit import unitrun

__all__ = [
    "XML_OUTPUT_FLAG",
    "create_xml_runner",
    "print_runner_summary",
    "print_unittest_summary",
    "rostest_name_from_path",
    "unitrun",
    "xml_results_file",
]

_LATE = ("pmon", "rosunit_main")


def __getattr__(name: str) -> ModuleType:
    """Import a module that is an attribute of rosunit in Noetic; on first use, to start scripts faster."""
    if name not in _LATE:
        raise AttributeError(f"module 'rosunit' has no attribute {name!r}")
    return importlib.import_module(f"rosunit.{name}")


_star_names(
    __name__,
    "rosunit.baretest rosunit.core rosunit.junitxml rosunit.pmon rosunit.pyunit rosunit.xmlrunner",
)

"""Drop-in replacement for Noetic's rosunit; a facade of `pipros.testing`."""

from __future__ import annotations

from pipros.basics.lazy_names import lazy_names as _lazy_names
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

__getattr__, __dir__ = _lazy_names(__name__, {}, submodules=("pmon", "rosunit_main"))

_star_names(
    __name__,
    "rosunit.baretest rosunit.core rosunit.junitxml rosunit.pmon rosunit.pyunit rosunit.xmlrunner",
)

"""Drop-in replacement for Noetic's rosunit; a facade of `pipros_tools.testing`."""

from __future__ import annotations

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

_star_names(
    __name__,
    "rosunit.baretest rosunit.core rosunit.junitxml rosunit.pyunit rosunit.rosunit_main rosunit.xmlrunner",
    hidden="rosunit_main",
)

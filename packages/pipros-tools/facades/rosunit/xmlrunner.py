"""A unittest runner that writes results as XML."""

from __future__ import annotations

import unittest
from pathlib import Path
from typing import TextIO

from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.replaced_file import write_whole as _write_whole
from pipros_tools.testing.runner import CaseResult, run_captured
from pipros_tools.testing.xunit import CDATA_END, CDATA_START, format_suite

_star_names(
    __name__,
    "codecs xml.sax.saxutils:escape ET=xml.etree.ElementTree os re io:StringIO sys time traceback",
)


def cdata(cdata_text: str) -> str:
    """Return the text as a CDATA section."""
    return CDATA_START + cdata_text + CDATA_END


class XMLTestRunner:
    """Test runner that writes results to a stream, or to `TEST-module.Class.xml` in the folder `path`."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream
        self._path = "."

    @property
    def path(self) -> str:
        """The folder for the result file; ignored if a stream is given."""
        return self._path

    @path.setter
    def path(self, path: str) -> None:
        self._path = path

    def run(self, test: unittest.TestSuite | unittest.TestCase) -> CaseResult:
        """Run the tests, and write their results and output as XML."""
        result, suite = run_captured(test)
        content = format_suite(suite)
        if self._stream is None:
            kind = type(test)
            name = f"TEST-{kind.__module__}.{kind.__name__}.xml"
            _write_whole(Path(self._path, name), content.encode())
        else:
            # The owner of the stream has written the XML declaration, as in genuine rosunit.
            self._stream.write(content.partition("\n")[2])
            self._stream.flush()
        return result

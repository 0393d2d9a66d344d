"""Nodes that compute with arrays use the memory of earlier ones again."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

PAGE_FAULTS = """
import resource
from pipros_libraries.nodes.kept_memory import keep_freed_memory
{}
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
arrays = [b"x" * 1_000_000 for _ in range(4)]
before = faults()
for _ in range(20):
    del arrays
    arrays = [b"x" * 1_000_000 for _ in range(4)]
print(faults() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc is configured")
def test_memory_of_freed_arrays_is_used_again_without_page_faults() -> None:
    def page_faults(call: str) -> int:
        command = [sys.executable, "-c", PAGE_FAULTS.format(call)]
        return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    assert page_faults("keep_freed_memory()") * 10 < page_faults("")

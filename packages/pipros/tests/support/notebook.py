"""Run the documents' notebook from a clean state. `python -m tests.support.notebook` stores its outputs.

Memory addresses and other noise of the outputs are removed, so that the file only changes with its contents.
"""

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbclient
import nbformat as _nbformat  # its functions have no types

from tests.support.environments import REPOSITORY

nbformat: Any = _nbformat
NOTEBOOK = REPOSITORY / "plugins" / "pipros-data" / "docs" / "guides" / "notebook.ipynb"


def run_notebook(folder: Path, notebook: Any | None = None) -> Any:
    """Run a notebook, by default that of the documentation, in an empty folder. Return it with its outputs.

    Raises `CellExecutionError` if a cell fails.
    """
    if notebook is None:
        notebook = nbformat.read(NOTEBOOK, as_version=4)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    path = os.environ["PATH"]
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{path}"
    try:
        resources = {"metadata": {"path": str(folder)}}
        return nbclient.NotebookClient(notebook, timeout=120, resources=resources).execute()
    finally:
        os.environ["PATH"] = path


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        notebook = run_notebook(Path(folder))
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    nbformat.write(notebook, NOTEBOOK)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Update the figures of README.md and of docs/reference/performance.md, from the tables of RESULTS.md.

    script/bench figures

A row of a document has the label of its row in RESULTS.md; code marks are ignored. Only the cells in columns
that `COLUMNS` names, and the date or dates after "results of" or "rounds of", are replaced.
"""

import re
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
DOCUMENTS = (ROOT / "README.md", ROOT / "docs" / "reference" / "performance.md")
#: For each column of a document, the columns of RESULTS.md that have its figures.
COLUMNS = {"genuine rospy": ("genuine",), "roscpp": ("roscpp",), "pipros": ("pipros", "pipros now")}


def tables(text):
    """Yield each row of the Markdown tables in a text: its line, the table's heads, and the cells."""
    heads = None
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else None
        if cells is None:
            heads = None
        elif heads is None:
            heads = cells
        elif set(line) - set("|-: "):
            yield line, heads, cells


def plain(label):
    return label.replace("`", "")


def with_figures(text, results):
    """Return a document with the figures and the date of the results.

    Raises:
        ValueError: a row of a table with the first head "workload" is not in the results.
    """
    found = {plain(cells[0]): dict(zip(heads, cells)) for _, heads, cells in tables(results)}  # noqa: B905
    for line, heads, cells in tables(text):
        row = found.get(plain(cells[0]))
        if row is None and heads[0] == "workload":
            raise ValueError(f"RESULTS.md has no row {cells[0]!r}")
        if row is not None:
            for number, head in enumerate(heads):
                names = [name for name in COLUMNS.get(head, ()) if name in row]
                cells[number] = row[names[0]] if names else cells[number]
            text = text.replace(line, re.sub(" +", " ", "| " + " | ".join(cells) + " |"))
    dates = sorted(set(re.findall(r"(?m)^`script/bench .*: commit .*?, (\d{4}-\d\d-\d\d),", results)))
    period = " to ".join(dates[:1] + dates[1:][-1:])
    dated = r"((?:\[the results\]\(\S+\)|rounds) of )\d{4}-\d\d-\d\d(?: to \d{4}-\d\d-\d\d)?"
    return re.sub(dated, rf"\g<1>{period}", text)


def update():
    results = (HERE / "RESULTS.md").read_text()
    for file in DOCUMENTS:
        file.write_text(with_figures(file.read_text(), results))


if __name__ == "__main__":
    update()

"""The documents and the tables of limits, of the core and of all plugins, say the same."""

import inspect
import re

from pipros.basics.limits import Limits, names_in, plugin_tables
from tests.support import documents
from tests.support.absent_plugins import DELETED


def test_the_tables_in_the_documents_have_every_limit() -> None:
    text = documents.text_of("internals/limits.md")
    for name in DELETED:
        text = re.sub(rf"(?s)`pipros_{name}\.[\w.]*limits\.\w+`:\n.*?(?=\n#)", "", text)
    rows = {
        cells[1].strip("` "): cells[2].strip()
        for line in text.splitlines()
        if len(cells := line.split("|")) == 5 and cells[1].strip().startswith("`")
    }

    assert rows == _defaults()


def test_the_documents_have_a_section_for_the_limits_of_each_plugin() -> None:
    text = documents.text_of("internals/limits.md")
    for table in plugin_tables():
        section = text.partition(f"`{table.__module__}.{table.__name__}`:\n")[2].partition("\n#")[0]
        assert re.findall(r"(?m)^\| `(\w+)`", section) == names_in(table)


def test_no_name_is_in_two_tables() -> None:
    names = [name for table in (Limits, *plugin_tables()) for name in names_in(table)]
    assert len(names) == len(set(names))


def test_each_limit_has_its_default_and_a_reason_to_change_it() -> None:
    """A limit without one is a constant beside the code that it bounds."""
    text = documents.text_of("reference/settings.md").partition("\n## Limits\n")[2].partition("\n## ")[0]
    rows = re.findall(r"(?m)^\| `(\w+)` \| ([\d,]+) \| [\w/]+ \| [^|]+ \|$", text)
    if not DELETED:
        assert sorted(rows) == sorted((name, value.split()[0]) for name, value in _defaults().items())
    assert len(rows) <= 40


def test_every_limit_is_described() -> None:
    for table in (Limits, *plugin_tables()):
        described = re.findall(r"(?m)^    (\w+): ", inspect.cleandoc(str(table.__doc__)))
        assert sorted(described) == sorted(table._fields)


def _defaults() -> dict[str, str]:
    tables = (Limits, *plugin_tables())
    return {name: _as_written(name, each._field_defaults[name]) for each in tables for name in names_in(each)}


def _as_written(name: str, value: float) -> str:
    """Format a default like the table: `1 MiB`, `10 s`, `20,000`."""
    if name.endswith("_bytes"):
        unit, size = ("MiB", 1 << 20) if value >= 1 << 20 else ("KiB", 1 << 10)
        return f"{value / size:,g} {unit}"
    return f"{value:g} s" if name.endswith("_s") else f"{value:,}"

"""Query topics with SQL, in a DuckDB database in a temporary folder.

Topics are copied to the database one batch at a time, so memory stays bounded. Before a query runs, access to
files, networks and extensions is disabled, and the configuration is locked.
"""

from __future__ import annotations

import itertools
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import PiprosError
from pipros.basics.printable import listed
from pipros_data.extras import library
from pipros_data.table import Table

if TYPE_CHECKING:
    from typing_extensions import Self

_BATCH_ROWS = 10_000
_BATCH = "batch_of_rows"

_LOCKS = (
    "SET python_enable_replacements = false",
    "SET enable_external_access = false",
    "SET lock_configuration = true",
)


class QueryError(PiprosError):
    """The query is not a single SELECT, or cannot be run."""


class Database:
    """A database with one table per topic.

    Args:
        folder: an empty folder for the database's files.
        topics: the topics to list in errors about unknown names.
        memory: the maximum memory that DuckDB may use.

    Raises:
        MissingExtra: duckdb or pyarrow is not installed.
    """

    def __init__(self, folder: str, topics: Sequence[str] = (), *, memory: str = "512MB") -> None:
        self._topics = topics
        self._arrow = library("pyarrow", "a query")
        self._duckdb = library("duckdb", "a query")
        self._thread = ThreadPoolExecutor(1)
        self._connection = self._work(
            self._duckdb.connect,
            os.path.join(folder, "topics.db"),
            config={
                "memory_limit": memory,
                "temp_directory": folder,
                "autoinstall_known_extensions": "false",
                "autoload_known_extensions": "false",
            },
        )
        self._is_locked = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        last = self._thread.submit(bool)
        while not last.done():
            self._connection.interrupt()  # repeated, because a query that is just starting ignores it
            wait([last], timeout=0.05)
        self._thread.shutdown()
        self._connection.close()

    def add(self, topic: str, tables: Iterable[Table], *, alias: str = "") -> None:
        """Add a table with a topic's name and rows. If `alias` is given, also add a view with this name.

        Raises:
            QueryError: a table or view with one of these names exists already. Names are not case-sensitive.
        """
        is_first = True
        for table in tables:
            self._work(self._connection.register, _BATCH, table.to_arrow())
            how = f"CREATE TABLE {_quoted(topic)} AS" if is_first else f"INSERT INTO {_quoted(topic)}"
            self._run(f"{how} SELECT * FROM {_BATCH}")  # noqa: S608 # quoted
            self._work(self._connection.unregister, _BATCH)
            is_first = False
        if alias:
            self._run(f"CREATE VIEW {_quoted(alias)} AS SELECT * FROM {_quoted(topic)}")  # noqa: S608

    def select(self, sql: str) -> Iterator[Any]:
        """Run a query. Yield an empty `pyarrow` table with the result's columns, then its rows in batches.

        Of columns with the same name, such as `a` of two topics, the later ones are `a_1`, `a_2` ..., as in
        DuckDB's subqueries. Afterwards, nothing can be added, and no query can read or write files.

        Raises:
            QueryError: the query is not a single SELECT, or fails.
        """
        if not self._is_locked:
            for each in _LOCKS:
                self._run(each)
            self._is_locked = True
        try:
            statements = self._work(self._connection.extract_statements, sql)
            if len(statements) != 1 or statements[0].type != self._duckdb.StatementType.SELECT:
                raise QueryError(f"the query must be a single SELECT, got {sql!r}")
            result = self._work(self._connection.sql, sql)
            read = getattr(result, "to_arrow_reader", None) or result.fetch_record_batch
            reader = self._work(read, _BATCH_ROWS)
            names = _unique(reader.schema.names)
            yield reader.schema.empty_table().rename_columns(names)
            while (batch := self._work(next, reader, None)) is not None:
                yield batch.rename_columns(names)
        except (self._duckdb.CatalogException, self._duckdb.BinderException) as error:
            hint = "Columns with dots need double quotes. Tables have the names of topics:"
            raise QueryError(f"{error}\n{hint} {', '.join(map(listed, self._topics))}") from None
        except (self._duckdb.Error, self._arrow.ArrowException) as error:
            raise QueryError(str(error)) from None

    def renamed(self, sql: str, names: Mapping[str, str]) -> str:
        """Return a query in which tables that are named in double quotes have other names."""
        data = sql.encode()
        quoted = {_quoted(old).encode(): _quoted(new).encode() for old, new in names.items()}
        tokens = [at for at, kind in self._duckdb.tokenize(sql) if kind == self._duckdb.token_type.identifier]
        for at in reversed(tokens):
            for old, new in quoted.items():
                if data.startswith(old, at):
                    data = data[:at] + new + data[at + len(old) :]
        return data.decode()

    def _work(self, function: Callable[..., Any], *arguments: object, **options: object) -> Any:
        """Call a DuckDB function in a thread. In the main thread, many of these functions ignore Ctrl-C."""
        return self._thread.submit(function, *arguments, **options).result()

    def _run(self, sql: str) -> Any:
        try:
            return self._work(self._connection.execute, sql)
        except self._duckdb.Error as error:
            raise QueryError(str(error)) from None


def queried(
    database: Database, sql: str, topics: Sequence[str], read: Callable[[str], Iterable[Table]]
) -> Iterator[Any]:
    """Add the topics that a query may refer to, and run it; see `Database.select`.

    Names in SQL are not case-sensitive. If topics differ only in case, their tables get other names, and the
    query must name these topics in double quotes, as they are written.
    """
    found = tables_in(sql, topics)
    counts = Counter(map(str.lower, found))
    names = {topic: f"{topic} ({number})" for number, topic in enumerate(found) if counts[topic.lower()] > 1}
    for topic, alias in found.items():
        database.add(names.get(topic, topic), read(topic), alias=alias)
    return database.select(database.renamed(sql, names) if names else sql)


def tables_in(sql: str, topics: Sequence[str]) -> dict[str, str]:
    """Return the topics that a query may refer to, each with its short name: `imu_data` for `/imu/data`.

    The short name is empty if it would be ambiguous. Topics named only in string literals are also
    returned; this is harmless. Case is ignored, except in names that differ only in case.
    """
    short = {topic: re.sub(r"\W", "_", topic.strip("/")) for topic in topics}
    shorts = Counter(map(str.lower, (*short.values(), *topics)))
    exact = Counter((*short.values(), *topics))
    folded = Counter(map(str.lower, topics))
    words = set(re.findall(r"\w+", sql)), set(re.findall(r"\w+", sql.lower()))
    text = sql.lower()
    found = {}
    for topic, name in short.items():
        is_unique = shorts[name.lower()] == 1
        is_short = name.lower() in words[1] if is_unique else exact[name] == 1 and name in words[0]
        whole = topic.replace('"', '""')
        if is_short or (whole.lower() in text if folded[topic.lower()] == 1 else whole in sql):
            found[topic] = name if is_unique or exact[name] == 1 else ""
    aliases = Counter(map(str.lower, found.values()))
    return {topic: name if aliases[name.lower()] == 1 else "" for topic, name in found.items()}


def _unique(names: Sequence[str]) -> list[str]:
    """Number the repetitions of names, without the names that exist."""
    unique: list[str] = []
    for name in names:
        numbered = (f"{name}_{number}" for number in itertools.count(1))
        unique.append(
            next(each for each in numbered if each not in (*names, *unique)) if name in unique else name
        )
    return unique


def _quoted(name: str) -> str:
    """Return a name as a quoted SQL identifier."""
    return '"{}"'.format(name.replace('"', '""'))

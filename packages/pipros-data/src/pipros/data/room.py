"""The declaration of the room `data`; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room, RoomCommand

_HEADING = "Analyse bags"

ROOM = Room(
    "data",
    "bags as tables",
    subcommands={
        "dataset": RoomCommand(
            "pipros.data.commands.dataset:main", "make data sets for training from bags", _HEADING
        )
    },
    verbs={
        "rosbag": {
            "query": RoomCommand(
                "pipros.data.commands.query:query", "Select rows of topics with SQL.", _HEADING
            ),
            "table": RoomCommand(
                "pipros.data.commands.table:table",
                "Write topics as a table: Parquet, Arrow or CSV.",
                _HEADING,
            ),
        }
    },
    limits="pipros.data.limits:DataLimits",
    offers={"limited_query": "pipros.data.limited_query:run_query"},
    # pyarrow, duckdb: the first versions with wheels for CPython 3.14; they also have wheels for 3.10.
    # pyarrow 26 needs numpy 2, which pipros[numpy] excludes before Python 3.13.
    # av, h5py: the first versions with wheels for Python 3.10 that read what newer versions write.
    # duckdb 2.0 prints long warnings about leaked instances when a program ends.
    extras={
        "data": (
            "numpy>=1.24",
            "pyarrow>=22,<26; python_version < '3.13'",
            "pyarrow>=22; python_version >= '3.13'",
            "duckdb>=1.4.2,<2",
            "av>=15",
            "h5py>=3.11",
        )
    },
)

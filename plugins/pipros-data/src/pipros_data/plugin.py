"""The declaration of the plugin `data`; see `pipros.basics.plugins`."""

from pipros.basics.plugins import BETA, EXPERIMENTAL, Plugin, PluginCommand

_HEADING = "Analyse bags"

PLUGIN = Plugin(
    "data",
    "bags as tables",
    subcommands={
        "dataset": PluginCommand(
            "pipros_data.commands.dataset:main", "make data sets for training from bags", _HEADING
        )
    },
    verbs={
        "rosbag": {
            "query": PluginCommand(
                "pipros_data.commands.query:query", "Select rows of topics with SQL.", _HEADING
            ),
            "table": PluginCommand(
                "pipros_data.commands.table:table",
                "Write topics as a table: Parquet, Arrow or CSV.",
                _HEADING,
            ),
        }
    },
    limits="pipros_data.limits:DataLimits",
    offers={"limited_query": "pipros_data.limited_query:run_query"},
    features={
        "tables and files": BETA,
        "SQL": BETA,
        "data sets for LeRobot": BETA,
        "control by policies": EXPERIMENTAL,
    },
)

"""The declaration of the plugin `tab`; see `pipros.basics.plugins`."""

from pipros.basics.plugins import BETA, Plugin

PLUGIN = Plugin(
    "tab",
    "nodes, masters and commands in Pyodide, one in each worker of a browser tab",
    offers={"tab": "pipros_tab.serve:serve_folder"},
    features={
        "the case study and the tutorials": BETA,
    },
)

"""The declaration of the room `tab`; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

ROOM = Room(
    "tab",
    "nodes, masters and commands in Pyodide, one in each worker of a browser tab",
    offers={"tab": "pipros.tab.serve:serve_folder"},
)

"""Call functions of catkin's modules with valid and invalid arguments; see `examine_api_nodes.py`."""

import os
import pathlib
import tempfile

from examination import begin, examine

MANIFEST = """<package format="2"><name>{}</name><version>0.1.0</version><description>d</description>
<maintainer email="me@example.org">me</maintainer><license>l</license></package>"""


def write(path, text):
    file = pathlib.Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)


def kind_of_error(function):
    try:
        return function()
    except Exception as error:
        return type(error).__name__


def examine_workspaces():
    import catkin.find_in_workspaces
    import catkin.workspace

    begin("workspaces")
    write("sources/deep/p/package.xml", MANIFEST.format("p"))
    write("sources/deep/p/x.txt", "")
    write("over/share/p/here.txt", "")
    write("over/lib/p/program", "")
    write("over/.catkin", f"{os.getcwd()}/sources;{os.getcwd()}/none")
    write("under/share/p/x.txt", "")
    write("under/etc/p/config", "")
    write("under/.catkin", "")
    spaces = [f"{os.getcwd()}/{name}" for name in ("over", "under")]
    here = os.getcwd()

    def shown(paths):
        return [path.replace(here, "…") for path in paths]

    find = catkin.find_in_workspaces.find_in_workspaces
    for arguments in (
        (None, None, None), (["share"], None, None), (["share"], "p", None), (["share"], "p", "x.txt"),
        (None, "p", None), (["bin"], "p", None), (["libexec"], None, None), (["libexec"], "p", None),
        (["nonsense"], None, None), ([], "p", None), (["etc", "include"], "p", None), (None, None, "p"),
        (None, "p", "x.txt"),
    ):  # fmt: skip
        looked = []
        examine(
            f"{arguments}",
            lambda: (shown(find(*arguments, _workspaces=spaces, considered_paths=looked)), shown(looked)),
        )
    for option in ("first_match_only", "first_matching_workspace_only"):
        examine(option, lambda: shown(find(["share"], "p", _workspaces=spaces, **{option: True})))
    for space in (*spaces, f"{here}/none"):
        examine("sources", lambda: kind_of_error(lambda: shown(catkin.workspace.get_source_paths(space))))


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    examine_workspaces()
    os.chdir("/")

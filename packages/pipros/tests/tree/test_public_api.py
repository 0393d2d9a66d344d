"""`pipros` itself has a short list of names, which are loaded when they are used."""

import importlib
import importlib.util
import inspect
import re
import subprocess
import sys

import pytest

import pipros
import pipros_tools.bag
import rospy
from tests.support import documents
from tests.support.absent_plugins import DELETED
from tests.support.environments import REPOSITORY

API = documents.text_of("reference/python.md")


@pytest.mark.parametrize("name", pipros.__all__)
def test_each_name_exists_and_is_described(name: str) -> None:
    assert getattr(pipros, name).__name__ == name
    assert re.search(rf"^\| `{name}[`(]", API, re.MULTILINE), (
        f"docs/reference/python.md does not describe {name}"
    )


def test_the_list_is_the_one_in_the_documents() -> None:
    assert sorted(re.findall(r"^\| `(\w+)", API, re.MULTILINE)) == sorted(pipros.__all__)
    assert set(pipros.__all__) <= set(dir(pipros))


def referenced(package: str) -> set[str]:
    """Return the objects of a package whose docstrings the reference shows."""
    text = API.partition(f"\n## {package}\n")[2].partition("\n## ")[0]
    return {line.rpartition(".")[2] for line in re.findall(r"^::: (\S+)$", text, re.MULTILINE)}


def test_the_reference_has_every_public_name() -> None:
    assert referenced("pipros") == {*pipros.__all__}
    assert referenced("pipros_tools.bag") == {*pipros_tools.bag.__all__}


def test_the_reference_of_rospy_has_every_class_and_function_that_scripts_call() -> None:
    inner = {"Message", "get_caller_id", "get_ros_root", "logout", "parse_rosrpc_uri", "remap_name"}
    offered = {
        name
        for name, value in vars(rospy).items()
        if name[0] != "_" and (inspect.isclass(value) or inspect.isfunction(value))
    }
    logging = {
        name for name in offered if name.startswith(("logdebug", "loginfo", "logwarn", "logerr", "logfatal"))
    }

    assert referenced("rospy") - {"TimerEvent"} == offered - inner - logging
    assert len(logging) == 20
    assert all(inspect.getdoc(getattr(rospy, name)) for name in offered)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Nodes'"):
        _ = pipros.Nodes  # type: ignore[attr-defined]


def test_importing_pipros_imports_nothing_else() -> None:
    script = "import sys; before = {*sys.modules, 'pipros'}; import pipros; print({*sys.modules} - before)"

    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)

    assert done.stdout == "set()\n"


DOCUMENTED = (
    *("pipros", "pipros_tools.bag", "pipros.basics.plugins", "pipros_data", "pipros_ros2"),
    "pipros_robot.navigation.costmap.layered",  # for own costmap layers
    *(f"pipros_libraries.nodes.{module}" for module in ("params", "program", "wiring")),
)


def test_documents_and_examples_use_only_the_public_names() -> None:
    texts = [REPOSITORY / "README.md", *documents.pages().values()]
    texts = [text for text in texts if text.name != "rtps.md"]  # about a part of pipros, not about its use
    texts += (REPOSITORY / "examples").glob("*/**/*.py")
    used = [
        f"{text.name}: {line}"
        for text in texts
        for line in re.findall(r"^\s*(?:from|import) pipros.*", text.read_text(), re.MULTILINE)
        if not re.match(r"from pipros\.ros1\.\w+\.(msg|srv) import ", line)
        and not any(f"pipros_{name}" in line for name in DELETED)
    ]

    allowed = [
        line
        for line in used
        if (names := re.search(rf"from ({'|'.join(DOCUMENTED)}) import (.*)", line)) is not None
        and {name.strip() for name in names[2].split(",")} <= set(importlib.import_module(names[1]).__all__)
    ]

    assert used == allowed
    assert used


def test_import_rospy_adds_nothing_to_modules_of_the_standard_library() -> None:
    # except the hooks of `sys`, and in `xml` and asyncio what loads parsers and `ssl` at their first use
    program = (
        "import sys, rospy\n"
        "for name, module in list(sys.modules.items()):\n"
        "    if name.partition('.')[0] in sys.stdlib_module_names - {'sys', 'xml'}:\n"
        "        for key in vars(module).keys() - {'ssl', 'sslproto'}:\n"
        "            value = getattr(module, key)\n"
        "            if str(getattr(value, '__module__', '')).partition('.')[0] in ('rospy', 'pipros'):\n"
        "                print(name, key)\n"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ran.stdout == ""


def test_each_import_that_the_upgrade_table_names_exists() -> None:
    text = documents.text_of("reference/upgrading.md").split("\n## ")[1]
    rows = re.findall(r"^\| import (.*) \| import (.*) \|$", text, re.MULTILINE)
    assert len(rows) > 5
    for row in rows:
        before, names = (re.findall(r"`(pipros[\w.]*)`", cell) for cell in row)
        assert len(names) == len(before)
        assert [name for name in before if importlib.util.find_spec(name)] == []
        for name in names:
            assert name.split(".")[0].removeprefix("pipros_") in DELETED or importlib.util.find_spec(name), (
                name
            )

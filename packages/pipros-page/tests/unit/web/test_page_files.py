"""The files of the page: unmodified third-party code, and nothing that the page's policy forbids."""

# needs tree_sitter
import asyncio
import base64
import hashlib
import re
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros_page.views import actions, calls, params
from pipros_page.views.actions import ActionViews
from pipros_page.views.calls import CallViews
from pipros_page.views.params import ParamViews
from pipros_server.daemon_pool import DaemonPool
from pipros_server.responses import IMPORT_MAP_HASH
from tests.support import page_bundle, page_primitives
from tests.support.environments import REPOSITORY, ROOTS, SOURCES, files_below, source
from tests.support.page_checks import PAGES

PAGE = source("pipros_page/page")
VENDOR = PAGE / "vendor"


def text_of(file: Path) -> str:
    return file.read_text(encoding="utf-8")


CHECKSUMS = dict(
    re.findall(r"^\| `(.+)` \| `([0-9a-f]{64})` \|$", text_of(REPOSITORY / "THIRD_PARTY.md"), re.MULTILINE)
)
OWN = [
    file
    for folder in SOURCES
    for file in files_below(folder, "*.js")
    if not {"vendor", "bundle"} & {*file.parts}
]


def test_third_party_code_is_listed() -> None:
    files = {file.relative_to(VENDOR).as_posix() for file in VENDOR.rglob("*") if file.is_file()}
    assert files == {*CHECKSUMS, "README.md"}


@pytest.mark.parametrize("name", CHECKSUMS)
def test_third_party_code_is_unchanged(name: str) -> None:
    assert hashlib.sha256((VENDOR / name).read_bytes()).hexdigest() == CHECKSUMS[name]


def test_the_checks_cover_all_pages() -> None:
    folders = [REPOSITORY / folder for folder in PAGES]
    assert [
        file for file in OWN if not any(file.resolve().is_relative_to(folder) for folder in folders)
    ] == []


def test_the_import_map_is_the_one_that_the_policy_allows() -> None:
    (text,) = {
        text
        for index in ("index.html", "bundle/index.html")
        for text in re.findall(r'<script type="importmap">(.*?)</script>', text_of(PAGE / index))
    }
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    assert f"'sha256-{digest}'" == IMPORT_MAP_HASH


def test_other_tabs_do_not_load_the_library_of_the_scene() -> None:
    importing = [file for file in OWN if re.search(r'from "three|import\("three', text_of(file))]
    assert {file.parent.name for file in importing} <= {"scene", "displays"}
    tabs = [file for file in OWN if re.search(r'from "[./]*scene/(?!(colours|link)\.js)', text_of(file))]
    assert [file.name for file in tabs] == ["scene.js"]


def test_the_bundle_is_that_of_the_sources() -> None:
    assert (page_bundle.BUNDLE / page_bundle.DIGEST).read_text("utf-8").strip() == page_bundle.digest(), (
        "run script/generate bundle"
    )


@pytest.mark.parametrize("file", OWN, ids=lambda file: file.name)
def test_text_from_the_system_is_never_markup(file: object) -> None:
    text = (PAGE / str(file)).read_text(encoding="utf-8")
    forbidden = r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function"
    assert not re.search(forbidden, text)


def test_every_tab_has_a_file() -> None:
    sections = text_of(PAGE / "sections.js")
    tabs = re.findall(r'^  \["(\w+)", "[\w ]+", "\w+"\],$', sections, re.MULTILINE)
    parts = re.findall(r'\["(\w+)", "\w+"\]', sections)
    assert {file.stem for file in (PAGE / "tabs").iterdir()} == {*tabs, *parts}


def test_the_table_of_numbers_is_that_of_the_library() -> None:
    assert page_primitives.FILE.read_text(encoding="utf-8") == page_primitives.module(), (
        "python -m tests.support.page_primitives"
    )


def test_no_other_table_repeats_the_primitive_types() -> None:
    files = [
        file for folder in ROOTS for pattern in ("*.py", "*.js") for file in files_below(folder, pattern)
    ]
    tables = {file.name for file in files if re.search(r'^\s*"?uint16"?: ', text_of(file), re.MULTILINE)}
    assert tables == {
        "spec.py",
        "primitives.js",
        "type_hash.py",  # the numbers that ROS 2 assigns in hashes
    }


# Values that browsers send are parsed and computed outside of the event loop, because they may be large.


POSE = {"name": "/arm", "type": "std_msgs/Float64"}


def first_publishing(system: Any, message: str) -> Any:
    async def run() -> None:
        async for _ in CallViews(system).publishing({**POSE, "message": message}):
            return

    return run()


REQUESTS: dict[str, Callable[[Any], Any]] = {
    "goal": lambda system: ActionViews(system).send_goal({**POSE, "goal": "{a: 1}"}),
    "large message": lambda system: first_publishing(system, "{data: 1" + " " * 20_000 + "}"),
    "expression": lambda system: first_publishing(system, '{data: "=i"}'),
    "parameter": lambda system: ParamViews(system).set_param({**POSE, "value": "1"}),
    "request": lambda system: CallViews(system).call_service({**POSE, "request": "[1]"}),
}


@pytest.mark.parametrize("kind", REQUESTS)
def test_values_are_parsed_in_threads(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    threads = []

    def noted(function: Callable[..., Any]) -> Callable[..., Any]:
        def run(*args: Any, **kwargs: Any) -> Any:
            threads.append(threading.current_thread())
            return function(*args, **kwargs)

        return run

    for module in (actions, calls, params):
        for name in {"load", "message_from_yaml"} & vars(module).keys():
            monkeypatch.setattr(module, name, noted(vars(module)[name]))

    async def refuse(_: object) -> None:
        raise ConnectionError

    pool = DaemonPool("test", 1)
    gate = SimpleNamespace(check_parameter=lambda *_: 1 / 0, advertise=lambda *_, **__: 1 / 0)
    node = SimpleNamespace(name="/page")
    calls_ = SimpleNamespace(run=refuse)
    system = SimpleNamespace(computations=pool, questions=pool, gate=gate, node=node, calls=calls_)
    with pytest.raises((ZeroDivisionError, ConnectionError, PiprosError)):
        asyncio.run(REQUESTS[kind](system))

    assert threads
    assert threading.main_thread() not in threads

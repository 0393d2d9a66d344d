"""The state of the master on disk: it is restored completely, and an unusable file is set aside."""

import sqlite3
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipros.master.params import ParamTree
from pipros.master.registry import Registry, Role
from pipros.master.store import Store, restore_params, restore_registrations
from tests.support.examples import examples
from tests.support.full_disk import files_limited_to
from tests.support.waiting import wait_until

A = "http://a:1/"


def reopened(file: Path) -> tuple[ParamTree, Registry]:
    store = Store(file)
    params, registry = ParamTree(), Registry()
    restore_params(params, store.restored)
    restore_registrations(registry, store.restored, {found.node for found in store.restored.registrations})
    store.close()
    return params, registry


def test_registrations_types_and_parameters_are_restored(tmp_path: Path) -> None:
    store = Store(tmp_path / "folder" / "master.db")
    registry, params = Registry(), ParamTree()
    registry.journal = params.journal = store
    registry.register_publisher("/p", "/t", "x/Y", A)
    registry.register_subscriber("/s", "/t", "*", "http://s:1/")
    registry.register_service("/p", "/srv", "rosrpc://a:5", A)
    registry.register_publisher("/p", "/left", "x/Y", A)
    registry.unregister(Role.PUBLISHER, "/p", "/left", A)
    params.set("/robot", {"name": "ü<&>", "list": [1, 2.5, True, {}]})
    params.set("/robot/name", "b")
    store.close()

    params, registry = reopened(store.file)
    assert params.get("/") == {"robot": {"name": "b", "list": [1, 2.5, True, {}]}}
    assert registry.table(Role.PUBLISHER) == [["/t", ["/p"]]]
    assert registry.table(Role.SUBSCRIBER) == [["/t", ["/s"]]]
    assert (registry.service_api_of("/srv"), registry.api_of("/s")) == ("rosrpc://a:5", "http://s:1/")
    assert registry.topic_types == {"/t": "x/Y", "/left": "x/Y"}


keys = st.lists(st.sampled_from("ab0"), min_size=1, max_size=3).map(lambda parts: "/" + "/".join(parts))
values = st.recursive(st.integers(0, 9), lambda inner: st.dictionaries(st.sampled_from("ab0"), inner))


@settings(max_examples=examples(40), deadline=None)
@example([("/a/a", 0), ("/a/a", None)])
@example([("/", {}), ("/a/a", 0), ("/a/a", None)])
@example([("/a", 5), ("/a/b", 1), ("/a/b", None)])
@given(st.lists(st.tuples(st.just("/") | keys, st.none() | values), max_size=15))
def test_the_tree_survives_any_changes_and_a_restart(
    tmp_path_factory: pytest.TempPathFactory, changes: list[tuple[str, Any]]
) -> None:
    store = Store(tmp_path_factory.mktemp("store") / "master.db")
    params = ParamTree()
    params.journal = store
    for key, value in changes:
        if value is None:
            if key != "/" and params.has(key):
                params.delete(key)
        elif key != "/" or isinstance(value, dict):
            params.set(key, value)
    store.close()
    assert reopened(store.file)[0].get("/") == params.get("/")


def test_a_single_change_is_written_at_once_and_pending_ones_on_close(tmp_path: Path) -> None:
    store = Store(tmp_path / "store", pause_s=1000.0)
    store.param_set("/first", 1)
    reader = sqlite3.connect(tmp_path / "store")
    wait_until(lambda: reader.execute("SELECT key FROM parameters").fetchall() == [("/first",)])
    reader.close()
    store.param_set("/last", 2)
    store.close()
    assert dict(Store(tmp_path / "store").restored.parameters) == {"/first": 1, "/last": 2}


def test_the_file_does_not_grow_with_the_number_of_changes(tmp_path: Path) -> None:
    store = Store(tmp_path / "master.db")
    params = ParamTree()
    params.journal = store
    for count in range(500):
        params.set("/counter", count)
        params.set(f"/once/{count}", 1)
        params.delete(f"/once/{count}")
    store.close()
    with sqlite3.connect(store.file) as database:
        assert database.execute("SELECT count(*) FROM parameters").fetchone() == (2,)
    database.close()


def torn(file: Path) -> None:
    store = Store(file)
    params = ParamTree()
    params.journal = store
    for count in range(300):
        params.set(f"/p{count}", "x" * 100)
    store.close()
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])


def foreign(file: Path) -> None:
    database = sqlite3.connect(file)
    database.execute("CREATE TABLE precious (data)")
    database.commit()
    database.close()


def of_the_future(file: Path) -> None:
    Store(file).close()
    database = sqlite3.connect(file)
    database.execute("PRAGMA user_version = 99")
    database.close()


def no_database(file: Path) -> None:
    file.write_text("my diary")


@pytest.mark.parametrize("spoil", [torn, foreign, of_the_future, no_database])
def test_an_unusable_store_is_set_aside_unchanged(spoil: Any, tmp_path: Path, caplog) -> None:
    file = tmp_path / "master.db"
    spoil(file)
    before = file.read_bytes()
    store = Store(file)
    store.close()
    assert store.restored.parameters == ()
    assert store.set_aside == tmp_path / "master.db.unusable-1"
    assert store.set_aside.read_bytes() == before
    assert f"{file} is not a usable master store" in caplog.text
    file.unlink()
    spoil(file)
    again = Store(file)
    again.close()
    assert again.set_aside == tmp_path / "master.db.unusable-2"


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
def test_a_full_disk_neither_ends_a_master_nor_moves_its_file_aside(tmp_path: Path, capsys) -> None:
    store = Store(tmp_path / "folder" / "master.db")
    store.param_set("/kept", 7)
    store.close()

    with files_limited_to(0):
        full = Store(store.file)
        full.param_set("/lost", 8)
        full.close()

    assert f"WARNING: cannot store parameters and registrations in [{store.file}]" in capsys.readouterr().err
    assert (full.restored.parameters, full.set_aside) == ((("/kept", 7),), None)
    assert reopened(store.file)[0].get("/") == {"kept": 7}


def test_a_store_without_a_folder_is_only_warned_about(tmp_path: Path, capsys) -> None:
    (tmp_path / "file").touch()
    store = Store(tmp_path / "file" / "master.db")
    store.close()
    assert (store.restored.parameters, store.restored.registrations) == ((), ())
    assert "WARNING: cannot store parameters" in capsys.readouterr().err

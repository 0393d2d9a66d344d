"""Certificates, access control of routers, and members that withstand a hostile one."""

import errno
import itertools
import json
import os
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from pipros.msg import load_service_class
from pipros_fleet import keys
from pipros_fleet.access import FleetRole
from pipros_fleet.agent import new_instance
from pipros_fleet.certificates import Authority, KeysFailed
from pipros_fleet.directory import Directory, DirectoryEntry, to_json
from pipros_fleet.key_files import read_keys
from pipros_fleet.messages import MessageAttachment, pack
from pipros_fleet.zenoh_connecting import connect, open_router
from pipros_fleet.zenoh_session import LinkFailed, SessionLink
from tests.graph.test_fleet_topics import publish_until
from tests.support.constants import Constants
from tests.support.fleet import LIMIT_S, Member, String, link_to
from tests.support.full_disk import files_limited_to
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

ACCEPTS = "{share: {topics: [/chatter]}, accept: {topics: [/cmd], services: [/reset]}}"


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    found = Authority.create(tmp_path / "fleet")
    for name in ("robot1", "robot2", "operator"):
        found.add(name)
    found.add("viewer", FleetRole.OBSERVER)
    return found


@pytest.fixture
def guarded(authority: Authority, claimed_port: ClaimedPort) -> Iterator[str]:
    address = f"tls/127.0.0.1:{claimed_port.number}"
    link = open_router([address], authority.router_tls(), authority.access())
    yield address
    link.close()


def link_of(authority: Authority, name: str, router: str) -> SessionLink:
    return link_to(router, read_keys(authority.folder / name).tls, asker=name)


def member(authority: Authority, name: str, router: str, file: str = "") -> Member:
    return Member(name, router, file, tls=read_keys(authority.folder / name).tls)


def test_members_with_certificates_work_together(authority: Authority, guarded: str) -> None:
    with (
        member(authority, "robot1", guarded, ACCEPTS) as robot,
        member(authority, "operator", guarded) as operator,
    ):
        talker = robot.node("talker").advertise("/chatter", String)
        commands = robot.receive("/cmd", name="base")
        operator.wait_for_topic("/robot1/chatter")
        received = operator.receive("/robot1/chatter")
        publish_until(talker, received, "hello")
        operator.wait_for_input("/robot1/cmd")
        publish_until(operator.node("teleop").advertise("/robot1/cmd", String), commands, "go")


def test_members_at_the_routers_of_two_sites_work_together(authority: Authority, guarded: str) -> None:
    port = ClaimedPort()
    other = f"tls/127.0.0.1:{port.number}"
    site = open_router([other], authority.router_tls(), authority.access(), others=[guarded])
    try:
        with (
            member(authority, "robot1", guarded, ACCEPTS) as robot,
            member(authority, "operator", other) as operator,
        ):
            talker = robot.node("talker").advertise("/chatter", String)
            commands = robot.receive("/cmd", name="base")
            operator.wait_for_topic("/robot1/chatter")
            publish_until(talker, operator.receive("/robot1/chatter"), "hello")
            operator.wait_for_input("/robot1/cmd")
            publish_until(operator.node("teleop").advertise("/robot1/cmd", String), commands, "go")
    finally:
        site.close()
        port.release()


def test_without_a_certificate_of_the_fleet_nothing_is_reached(
    authority: Authority, guarded: str, tmp_path: Path
) -> None:
    other = Authority.create(tmp_path / "other")
    foreign = read_keys(other.add("robot1")).tls
    with pytest.raises(LinkFailed, match="cannot reach the router"):
        connect(guarded, foreign)
    with pytest.raises(LinkFailed, match="cannot reach the router"):
        connect(guarded.replace("tls/", "tcp/"))


def test_a_member_cannot_pose_as_a_router(authority: Authority) -> None:
    port = ClaimedPort()
    address = f"tls/127.0.0.1:{port.number}"
    fake = open_router([address], read_keys(authority.folder / "robot2").tls)
    try:
        with pytest.raises(LinkFailed, match="cannot reach the router"):
            connect(address, read_keys(authority.folder / "robot1").tls)
    finally:
        fake.close()
        port.release()


def test_a_member_cannot_speak_for_another(authority: Authority, guarded: str) -> None:
    """A member cannot join, publish, send commands or answer under another name."""
    with (
        member(authority, "operator", guarded) as operator,
        member(authority, "robot1", guarded, ACCEPTS) as one,
    ):
        commands = one.receive("/cmd", name="base")
        operator.wait_for_input("/robot1/cmd")
        with closing(link_of(authority, "robot2", guarded)) as spy:
            held = [
                spy.declare_token(keys.live("robot9", keys.VERSION, new_instance())),
                spy.declare_token(keys.live("robot2", keys.VERSION, new_instance())),
            ]
            false = Directory("robot1", one.agent.instance, 1000)
            spy.put(keys.directory("robot1"), to_json(false))
            attachment = pack(MessageAttachment(0, new_instance(), 1, 0, String._md5sum))
            spy.put(keys.into("operator", "robot1", "/cmd"), b"\x01\0\0\0x", attachment)
            with pytest.raises(LinkFailed, match="not allowed to call"):
                # it may ask under its own name, and is then refused by the robot's file
                spy.get(keys.service("robot1", "robot2", "/reset"), timeout_s=LIMIT_S)
            assert spy.get(keys.service("robot1", "operator", "/reset"), timeout_s=2) == []

            wait_until(lambda: "robot2" in operator.agent.statistics()["members"], LIMIT_S, "its own token")
            assert "robot9" not in operator.agent.statistics()["members"]
            assert "/robot1/cmd" in operator.state().subscribers, "the false directory was not delivered"
            publish_until(operator.node("teleop").advertise("/robot1/cmd", String), commands, "go")
            assert not [each for each in commands if each.data == "x"]
            assert len(held) == 2


def test_an_observer_receives_but_changes_nothing(authority: Authority, guarded: str) -> None:
    with (
        member(authority, "robot1", guarded, ACCEPTS) as robot,
        member(authority, "viewer", guarded) as viewer,
    ):
        talker = robot.node("talker").advertise("/chatter", String)
        commands = robot.receive("/cmd", name="base")
        viewer.wait_for_topic("/robot1/chatter")
        publish_until(talker, viewer.receive("/robot1/chatter"), "hello")
        viewer.wait_for_input("/robot1/cmd")
        wrong = viewer.node("teleop").advertise("/robot1/cmd", String)
        wait_until(lambda: wrong.connection_count, LIMIT_S, "a connection")
        for _ in range(10):
            wrong.publish(String("stray"))
        wait_until(lambda: viewer.agent.statistics()["sent"], LIMIT_S, "what it sends")
        assert viewer.link.get(keys.service("robot1", "viewer", "/reset"), timeout_s=1) == []
        publish_until(talker, viewer.receive("/robot1/chatter", name="again"), "later")
        assert commands == []


def test_revoking_ends_the_link_of_a_member(ros: RosSystem, authority: Authority) -> None:
    port = ClaimedPort()
    address = f"tls/127.0.0.1:{port.number}"
    router = ros.pipros.start("pipros", "fleet", "router", address, "--keys", str(authority.folder))
    router.wait_for("router at")
    with member(authority, "operator", address) as operator:
        tls = read_keys(authority.folder / "robot1").tls
        with Member("robot1", address, ACCEPTS, tls=tls) as robot:
            robot.node("talker").advertise("/chatter", String)
            operator.wait_for_topic("/robot1/chatter")
            authority.revoke("robot1")
            router.wait_for("the list of members has changed")
            wait_until(lambda: "/robot1/chatter" not in operator.state().publishers, LIMIT_S, "robot1 to go")
        with member(authority, "robot2", address, ACCEPTS) as other:
            other.node("talker").advertise("/chatter", String)
            operator.wait_for_topic("/robot2/chatter")
    router.press_ctrl_c()
    assert router.wait() == 0
    port.release()


def test_an_authority_adds_renews_and_revokes_members(tmp_path: Path) -> None:
    before_umask = os.umask(0)
    try:
        authority = Authority.create(tmp_path / "new" / "fleet")
        folder = authority.add("robot1")
    finally:
        os.umask(before_umask)
    for each in (tmp_path / "new", *(tmp_path / "new").rglob("*")):
        assert each.stat().st_mode & 0o022 == 0, each  # others cannot change it
    assert (folder / "member.key").stat().st_mode & 0o777 == 0o600
    assert (authority.folder / "fleet.key").stat().st_mode & 0o777 == 0o600
    before = (folder / "member.crt").read_bytes()
    authority.renew("robot1")
    assert (folder / "member.crt").read_bytes() != before
    authority.renew("router")
    assert authority.members() == {"robot1": FleetRole.MEMBER}
    for wrong, reason in (
        (lambda: authority.add("robot1"), "already exists"),
        (lambda: authority.add("router"), "is reserved for routers"),
        (lambda: authority.add("a/b"), "is not a legal name"),
        (lambda: authority.renew("robot2"), "there is no member"),
        (lambda: authority.revoke("robot2"), "there is no member"),
        (lambda: Authority.create(authority.folder), "already has an authority"),
        (lambda: Authority(tmp_path), "has no authority"),
    ):
        with pytest.raises((KeysFailed, ValueError), match=reason):
            wrong()
    authority.revoke("robot1")
    assert authority.members() == {}
    authority.members_file.write_text("nonsense")
    with pytest.raises(KeysFailed, match="cannot read"):
        authority.members()


@pytest.mark.needs("resource limits")
def test_on_a_full_disk_keys_stay_complete(tmp_path: Path) -> None:
    authority = Authority.create(tmp_path / "fleet")
    folder = authority.add("bob")
    before = {path: path.read_bytes() for path in authority.folder.rglob("*") if path.is_file()}
    full = f"{os.strerror(errno.EFBIG)}"

    with files_limited_to(300):  # enough for a key, but not for its certificate
        for attempt in (lambda: authority.renew("bob"), lambda: authority.add("ann")):
            with pytest.raises(KeysFailed, match=rf"cannot issue a certificate .*{full}: '.*(bob|ann)'$"):
                attempt()
        with pytest.raises(KeysFailed, match=rf"cannot write .*new\]: {full}$"):
            Authority.create(tmp_path / "new")
    with files_limited_to(2), pytest.raises(KeysFailed, match=rf"cannot write .*members\.json: {full}$"):
        authority.revoke("bob")

    assert {path: path.read_bytes() for path in authority.folder.rglob("*") if path.is_file()} == before
    assert sorted(os.listdir(folder.parent)) == ["bob", "fleet.crt", "fleet.key", "members.json", "router"]
    Authority.create(tmp_path / "new").add("ann")


def test_malformed_messages_of_a_member_disturb_nothing(operator: Member, hostile: SessionLink) -> None:
    """A member sends malformed data with every key that it may use."""
    instance = new_instance()
    requests: list[bytes] = []
    entries = (DirectoryEntry("/chatter", "std_msgs/String", String._md5sum),)
    answer = _answering(to_json(Directory("bad", instance, 1, entries)))
    held = [
        hostile.subscribe(keys.wanted("operator", "bad"), lambda _, document, __: requests.append(document)),
        hostile.serve(keys.directory("bad"), answer),
        hostile.declare_token(keys.live("bad", keys.VERSION, instance)),
    ]
    operator.wait_for_topic("/bad/chatter")
    received = operator.receive("/bad/chatter")
    # They come after the operator's subscription, which therefore is known on the way.
    wait_until(lambda: any(b"/chatter" in each for each in requests), LIMIT_S, "the topic to be wanted")
    good = MessageAttachment(0, instance, 1, 0, String._md5sum)
    body = b"\x02\0\0\0ok"
    for payload, attachment in (
        (body, b""),
        (body, b"x" * 48),
        (body, pack(MessageAttachment(0, instance, 1, 0, "0" * 32))),
        (body, pack(MessageAttachment(0, instance, 1, 0, String._md5sum, is_compressed=True))),
    ):
        hostile.put(keys.topic("bad", "/chatter"), payload, attachment, waits=True)
    for document in (b"", b"\xff", b"[]", b"[" * 50_000, b"x" * (5 * 1024 * 1024), json.dumps(1).encode()):
        hostile.put(keys.directory("bad"), document, waits=True)
        hostile.put(keys.wanted("bad", "operator"), document, waits=True)
    hostile.put(keys.topic("bad", "/chatter"), body, pack(good), waits=True)
    wait_until(lambda: received, LIMIT_S, "the good message")
    assert [each.data for each in received] == ["ok"]
    (counts,) = operator.agent.statistics()["received"].values()
    assert (counts[3], len(held)) == (4, 3)


def _answering(payload: bytes) -> Any:
    def answer(question: Any) -> None:
        question.answer(payload)
        question.close()

    return answer


def test_a_member_of_another_version_is_reported_and_ignored(router: str, operator: Member) -> None:
    with closing(link_to(router)) as other:
        held = other.declare_token(keys.live("future", keys.VERSION + 1, new_instance()))
        expected = f"[future] is ignored: it uses version {keys.VERSION + 1} of the fleet protocol"
        wait_until(lambda: any(expected in each for each in operator.warnings), LIMIT_S, expected)
        assert "future" not in operator.agent.statistics()["members"]
        del held


def test_of_two_members_with_one_name_the_later_one_ends(router: str, robot: Member) -> None:
    """Two members joined while the link between them was cut, so neither could see the other."""
    with closing(link_to(router)) as twin:
        older = twin.declare_token(keys.live("robot1", keys.VERSION, "0" * 16))
        wait_until(lambda: robot.failures, LIMIT_S, "the later one to end")
        assert "already has a member [robot1]" in str(robot.failures[0])
        del older


def test_a_flood_of_tokens_is_bounded_and_disturbs_no_other(router: str, constants: Constants) -> None:
    constants(FLEET_MEMBERS=20)
    with Member("operator", router) as operator, Member("robot1", router) as robot:
        talker = robot.node("talker").advertise("/chatter", String)
        operator.wait_for_topic("/robot1/chatter")
        received = operator.receive("/robot1/chatter")
        publish_until(talker, received, "first")  # both know each other: a full list has no place for others
        with closing(link_to(router)) as hostile:
            live = [keys.live(f"x{n}", keys.VERSION, new_instance()) for n in range(200)]
            held = list(map(hostile.declare_token, live))
            wait_until(lambda: len(operator.agent.statistics()["members"]) == 20, LIMIT_S, "the limit")
            publish_until(talker, received, "still")
            assert len(held) == 200


def test_a_flood_of_messages_is_bounded_and_disturbs_no_other(router: str) -> None:
    """One member publishes to accepted and refused topics as fast as it can."""
    with (
        Member("robot1", router, "accept: {topics: [/cmd]}") as robot,
        Member("operator", router) as operator,
    ):
        commands = robot.receive("/cmd", name="base")
        operator.wait_for_input("/robot1/cmd")
        with closing(link_to(router)) as hostile:
            instance = new_instance()
            held = hostile.declare_token(keys.live("bad", keys.VERSION, instance))
            wait_until(lambda: "bad" in robot.agent.statistics()["members"], LIMIT_S, "its token")
            numbers = itertools.count(1)

            def flood() -> bool:
                number = next(numbers)
                attachment = pack(MessageAttachment(0, instance, number, 0, String._md5sum))
                hostile.put(keys.into("bad", "robot1", "/cmd"), b"\x04\0\0\0junk", attachment)
                hostile.put(keys.into("bad", "robot1", f"/other{number}\n\x1b[2J"), b"junk", attachment)
                return len(robot.warnings) == 500

            for _ in range(3000):
                flood()
            publish_until(operator.node("teleop").advertise("/robot1/cmd", String), commands, "go")
            # A full link drops messages, so it takes an unknown number of them.
            wait_until(lambda: any(flood() for _ in range(20)), LIMIT_S, "a limited number of warnings")
            assert all(each.isprintable() for each in robot.warnings), held


def test_calls_and_answers_of_a_member_leave_room_for_others(
    router: str, operator: Member, hostile: SessionLink, constants: Constants
) -> None:
    constants(FLEET_CALLS=4)
    with Member("robot1", router, "accept: {services: [/slow, /fast], parameters: [/**]}") as robot:
        empty: Any = load_service_class("std_srvs/Empty")
        may_end, server = threading.Event(), robot.node("server")
        for name, wait in (("/slow", may_end.wait), ("/fast", bool)):
            server.serve(name, empty, lambda _, wait=wait: (wait(), empty._response_class())[1])
        operator.wait_for_service("/robot1/fast")
        slow = keys.service("robot1", "bad", "/slow")
        for _ in range(2):
            threading.Thread(target=_asked, args=(hostile, slow), daemon=True).start()
        wait_until(lambda: "too many calls" in _asked(hostile, slow), LIMIT_S, "its share to be used")
        assert "payload=b'\\x01" in _asked(operator.link, keys.service("robot1", "operator", "/fast"))
        may_end.set()
        refusal = "the request about a parameter has 6291456 bytes; the limit is 4194304 bytes"
        assert _asked(hostile, keys.parameters("robot1", "set", "bad"), b"[]," * 2**21) == refusal
        hostile.serve(keys.statistics("bad"), lambda each: list(map(each.answer, [bytes(2**20)] * 40)))
        wait_until(lambda: len(operator.link.get(keys.statistics("bad"), timeout_s=9)) == 15, LIMIT_S, "15")


def _asked(link: SessionLink, key: str, payload: bytes = b"") -> str:
    try:
        return str(link.get(key, payload, timeout_s=5))
    except LinkFailed as error:
        return str(error)


def test_an_oversized_message_is_dropped_and_later_ones_arrive(router: str) -> None:
    limit_bytes = 200_000
    with (
        Member("operator", router, limits={"fleet_message_bytes": limit_bytes}) as operator,
        Member("robot1", router) as robot,
    ):
        talker = robot.node("talker").advertise("/chatter", String)
        operator.wait_for_topic("/robot1/chatter")
        received = operator.receive("/robot1/chatter")
        publish_until(talker, received, "before")
        talker.publish(String("x" * (3 * limit_bytes)))
        publish_until(talker, received, "after")
        assert max(len(each.data) for each in received) < limit_bytes


def test_a_name_that_cannot_be_shown_hides_no_other(operator: Member, hostile: SessionLink) -> None:
    """A member has the name of the agent's node, and offers a service with the name of the node's own."""
    name, instance, md5sum = "pipros_fleet_operator", new_instance(), "0" * 32
    shared = (DirectoryEntry("/chatter", "std_msgs/String", String._md5sum),)
    services = (DirectoryEntry("/link", "a/B", md5sum), DirectoryEntry("/other", "a/B", md5sum))
    directory = Directory(name, instance, 1, shared, (), services)
    held = [
        hostile.serve(keys.directory(name), _answering(to_json(directory))),
        hostile.declare_token(keys.live(name, keys.VERSION, instance)),
    ]
    operator.wait_for_service(f"/{name}/other")
    operator.wait_for_topic(f"/{name}/chatter")
    expected = f"[/link] of [{name}] is not shown: service [/{name}/link] already registered"
    wait_until(lambda: expected in operator.warnings, LIMIT_S, expected)
    assert len(held) == 2


def test_topics_and_services_of_all_members_together_are_limited(router: str, constants: Constants) -> None:
    constants(FLEET_TOPICS=5)
    topics = tuple(
        DirectoryEntry(f"/topic{number}", "std_msgs/String", String._md5sum) for number in range(5)
    )
    services = (DirectoryEntry("/service0", "a/B", "0" * 32), DirectoryEntry("/service1", "a/B", "0" * 32))
    directories = {
        "first": (topics[:2], topics[2:4], services), "second": (topics, (), ()),
        "third": (topics[:3], topics[3:], services), "last": ((), (), ()),
    }  # fmt: skip
    with Member("operator", router) as operator, closing(link_to(router)) as others:
        held, tokens = [], {}
        for name, offers in directories.items():
            instance = new_instance()
            answer = _answering(to_json(Directory(name, instance, 1, *offers)))
            held.append(others.serve(keys.directory(name), answer))
            tokens[name] = others.declare_token(keys.live(name, keys.VERSION, instance))
            wait_until(lambda name=name: name in operator.agent.shown, LIMIT_S, name)

        def shown() -> dict[str, tuple[int, int, int]]:
            return {
                name: (len(each.sinks), len(each.inputs), len(each.services))
                for name, each in operator.agent.shown.copy().items()
            }

        shares = {"first": (2, 0, 0), "second": (1, 0, 0), "third": (2, 0, 0), "last": (0, 0, 0)}
        wait_until(lambda: shown() == shares, LIMIT_S, lambda: str(shown()))
        assert any("[second] offers too many topics" in each for each in operator.warnings)
        tokens["first"].undeclare()
        left = {"second": (2, 0, 0), "third": (3, 0, 0), "last": (0, 0, 0)}
        wait_until(lambda: shown() == left, LIMIT_S, lambda: str(shown()))
        assert len(held) == 4


def test_definitions_of_a_member_are_limited_and_forgotten_with_their_topics(
    router: str, constants: Constants
) -> None:
    constants(FLEET_DEFINITION_BYTES=180)
    md5sum, text = "0" * 32, "string data  # " + 60 * "x"
    both = (DirectoryEntry("/topic0", "a/Type0", md5sum), DirectoryEntry("/topic1", "a/Type1", md5sum))
    requested: list[str] = []

    def answer(question: Any) -> None:
        requested.append(question.key)
        question.answer(json.dumps([md5sum, text]).encode())
        question.close()

    with Member("operator", router) as operator, closing(link_to(router)) as other:
        instance = new_instance()
        held = [
            other.serve(keys.definition("robot1", "*"), answer),
            other.serve(
                keys.directory("robot1"), _answering(to_json(Directory("robot1", instance, 1, both)))
            ),
            other.declare_token(keys.live("robot1", keys.VERSION, instance)),
        ]
        operator.wait_for_topic("/robot1/topic0")
        operator.wait_for_topic("/robot1/topic1")
        expected = "too many definitions of other members"
        assert [each for each in operator.warnings if expected in each] == operator.warnings
        for revision, entries in enumerate([(), both[:1], (), both[:1]], 2):
            other.put(keys.directory("robot1"), to_json(Directory("robot1", instance, revision, entries)))
            names = {entry.name for entry in entries}
            sinks = operator.agent.shown["robot1"].sinks
            wait_until(lambda sinks=sinks, names=names: sinks.keys() == names, LIMIT_S, "the change")
        assert sorted(requested) == 3 * [keys.definition("robot1", "a/Type0")] + [
            keys.definition("robot1", "a/Type1")
        ]
        assert (len(operator.warnings), len(held)) == (1, 3)

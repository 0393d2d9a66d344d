"""Members that join and leave, also while the link is down."""

import pytest

from pipros_fleet import keys
from pipros_fleet.health import CHECK
from pipros_fleet.members import TOKENS_PER_MEMBER, Members, Token
from pipros_fleet.presence import LEAVE_S, RETURN_S, Presence
from pipros_fleet.statistics import LinkTraffic, link_statuses
from pipros_libraries.diagnostics.link_status import LinkLevel, LinkStatus
from pipros_tools.health.plugin_check import PluginReply, plugin_checks

ME = "operator"
EARLY, NOW, LATE = "0" * 16, "5" * 16, "9" * 16


class Heard:
    """Listener that records what `Presence` reports."""

    def __init__(self) -> None:
        self.events: list[str] = []

    def on_joined(self, token: Token) -> None:
        self.events.append(f"{token.member} {token.instance[0]} joined")

    def on_returned(self, member: str) -> None:
        self.events.append(f"{member} returned")

    def on_away(self, member: str) -> None:
        self.events.append(f"{member} away")

    def on_left(self, member: str) -> None:
        self.events.append(f"{member} left")

    def on_older_namesake(self) -> None:
        self.events.append("older namesake")

    def on_crowded(self, member: str) -> None:
        self.events.append(f"{member} is crowded")

    def on_other_version(self, token: Token) -> None:
        self.events.append(f"{token.member} version {token.version}")


def presence() -> tuple[Presence, list[str]]:
    heard = Heard()
    return Presence(ME, NOW, 10, heard), heard.events


def robot(instance: str = NOW) -> str:
    return keys.live("robot1", keys.VERSION, instance)


def test_a_member_leaves_a_moment_after_its_token() -> None:
    found, events = presence()
    found.update(robot(), is_present=True, now_s=0)
    found.update(robot(), is_present=False, now_s=1)
    found.remove_departed(is_connected=True, now_s=1 + LEAVE_S / 2)
    assert found.present().keys() == {"robot1"}
    found.remove_departed(is_connected=True, now_s=1 + LEAVE_S)
    assert (events, found.present()) == (["robot1 5 joined", "robot1 away", "robot1 left"], {})


def test_a_token_that_is_back_at_once_is_a_return() -> None:
    found, events = presence()
    found.update(robot(), is_present=True, now_s=0)
    found.update(robot(), is_present=False, now_s=1)
    found.update(robot(), is_present=True, now_s=1)
    found.remove_departed(is_connected=True, now_s=10)
    assert events == ["robot1 5 joined", "robot1 away", "robot1 returned"]


def test_members_stay_while_the_link_is_down_and_have_time_to_return() -> None:
    found, events = presence()
    other = keys.live("robot2", keys.VERSION, NOW)
    for key in (robot(), other):
        found.update(key, is_present=True, now_s=0)
        found.update(key, is_present=False, now_s=1)
    found.remove_departed(is_connected=False, now_s=2)
    found.remove_departed(is_connected=False, now_s=100)
    assert found.present().keys() == {"robot1", "robot2"}
    found.note_connection(now_s=100)
    found.update(robot(), is_present=True, now_s=101)
    found.remove_departed(is_connected=True, now_s=100 + RETURN_S)
    assert events == [
        "robot1 5 joined", "robot1 away", "robot2 5 joined", "robot2 away", "robot1 returned", "robot2 left",
    ]  # fmt: skip


def test_a_member_whose_agent_was_restarted_has_not_left() -> None:
    found, events = presence()
    found.update(robot(EARLY), is_present=True, now_s=0)
    found.update(robot(LATE), is_present=True, now_s=1)
    found.update(robot(EARLY), is_present=False, now_s=2)
    found.remove_departed(is_connected=True, now_s=3)
    assert events == ["robot1 0 joined", "robot1 9 joined", "robot1 9 joined"]
    assert found.present()["robot1"].instance == LATE


def test_of_two_namesakes_only_the_later_one_is_notified() -> None:
    found, events = presence()
    found.update(keys.live(ME, keys.VERSION, LATE), is_present=True, now_s=0)
    assert events == []
    found.update(keys.live(ME, keys.VERSION, EARLY), is_present=True, now_s=0)
    assert events == ["older namesake"]


def test_other_versions_and_malformed_tokens_are_not_present() -> None:
    found, events = presence()
    found.update(keys.live("future", keys.VERSION + 1, NOW), is_present=True, now_s=0)
    found.update("pipros/a/live/1/nonsense", is_present=True, now_s=0)
    found.update("pipros/a/live/1/nonsense", is_present=False, now_s=0)
    found.remove_departed(is_connected=True, now_s=10)
    assert (events, found.present()) == ([f"future version {keys.VERSION + 1}"], {})


def test_many_tokens_of_one_member_hide_no_other() -> None:
    heard = Heard()
    found = Presence(ME, NOW, 3, heard)
    for number in range(1_000):
        found.update(keys.live("evil", keys.VERSION, f"{number:016}"), is_present=True, now_s=0)
    found.update(robot(), is_present=True, now_s=0)

    assert found.present().keys() == {"evil", "robot1"}
    assert found.present()["evil"].instance == f"{999:016}"
    assert "robot1 5 joined" in heard.events
    assert "evil is crowded" in heard.events


def test_members_that_were_too_many_are_shown_when_another_leaves() -> None:
    heard = Heard()
    found = Presence(ME, NOW, 2, heard)
    for name in ("robot1", "robot2", "robot3"):
        found.update(keys.live(name, keys.VERSION, NOW), is_present=True, now_s=0)
    assert found.present().keys() == {"robot1", "robot2"}

    found.update(robot(), is_present=False, now_s=1)
    found.remove_departed(is_connected=True, now_s=1 + LEAVE_S)

    assert found.present().keys() == {"robot2", "robot3"}
    assert heard.events[-2:] == ["robot1 left", "robot3 5 joined"]


# Tokens of the members that are present.


OLD, NEW = "0" * 16, "1" * 16


def test_the_newer_of_two_runs_is_used() -> None:
    members = Members(10)
    assert members.update(keys.live("r1", keys.VERSION, NEW), is_present=True) == Token("r1", NEW)
    assert members.update(keys.live("r1", keys.VERSION, OLD), is_present=True) == Token("r1", OLD)
    assert members.update(keys.live("r1", keys.VERSION, OLD), is_present=True) is None
    assert members.present() == {"r1": Token("r1", NEW)}
    assert [token.instance for token in members.of("r1")] == [OLD, NEW]
    assert members.update(keys.live("r1", keys.VERSION, NEW), is_present=False) == Token("r1", NEW)
    assert members.present() == {"r1": Token("r1", OLD)}


def test_members_of_other_versions_are_not_used() -> None:
    members = Members(10)
    members.update(keys.live("r1", 9, OLD), is_present=True)
    assert members.present() == {}
    assert members.of("r1") == [Token("r1", OLD, 9)]


def test_malformed_tokens_and_too_many_are_ignored() -> None:
    members = Members(1)
    assert members.update("pipros/r1/live/x/y", is_present=True) is None
    members.update(keys.live("r1", keys.VERSION, OLD), is_present=True)
    assert members.update(keys.live("r2", keys.VERSION, OLD), is_present=True) is None
    assert members.update(keys.live("r2", keys.VERSION, OLD), is_present=False) is None
    assert set(members.present()) == {"r1"}


def test_a_member_waits_for_room_and_is_admitted_once() -> None:
    members = Members(1)
    members.update(keys.live("r1", keys.VERSION, OLD), is_present=True)
    for instance in (OLD, NEW):
        assert members.update(keys.live("r2", keys.VERSION, instance), is_present=True) is None
    assert members.admit_waiting() == []

    members.update(keys.live("r1", keys.VERSION, OLD), is_present=False)
    # At most as many tokens wait as the limit allows names.
    assert members.admit_waiting() == [Token("r2", OLD)]
    assert members.admit_waiting() == []
    assert members.present() == {"r2": Token("r2", OLD)}


def test_two_waiting_tokens_of_one_name_share_its_place() -> None:
    members = Members(2)
    for name in ("r1", "r2"):
        members.update(keys.live(name, keys.VERSION, OLD), is_present=True)
    for instance in (OLD, NEW):
        members.update(keys.live("r3", keys.VERSION, instance), is_present=True)
    members.update(keys.live("r1", keys.VERSION, OLD), is_present=False)

    assert members.admit_waiting() == [Token("r3", OLD), Token("r3", NEW)]
    assert members.present() == {"r2": Token("r2", OLD), "r3": Token("r3", NEW)}


def test_a_member_that_leaves_while_it_waits_is_not_admitted() -> None:
    members = Members(1)
    members.update(keys.live("r1", keys.VERSION, OLD), is_present=True)
    members.update(keys.live("r2", keys.VERSION, OLD), is_present=True)
    members.update(keys.live("r2", keys.VERSION, OLD), is_present=False)
    members.update(keys.live("r1", keys.VERSION, OLD), is_present=False)

    assert members.admit_waiting() == []


def test_the_newest_tokens_of_a_name_are_kept_and_the_name_is_reported() -> None:
    members = Members(10)
    instances = [f"{number:016x}" for number in range(1, TOKENS_PER_MEMBER + 2)]
    for instance in instances:
        assert members.update(keys.live("r1", keys.VERSION, instance), is_present=True) == Token(
            "r1", instance
        )
    assert members.update(keys.live("r1", keys.VERSION, "0" * 16), is_present=True) is None

    assert [token.instance for token in members.of("r1")] == instances[1:]
    assert members.crowded == {"r1"}


# Diagnostics of a member's links.


def statuses(is_connected: bool = True, **before: LinkTraffic) -> list[LinkStatus]:
    return link_statuses(
        "operator", is_connected=is_connected, sent=[(1, 10, 2, 3), (4, 40, 0, 0)],
        received={"robot2": LinkTraffic(1, 5), "robot1": LinkTraffic(2, 100, 7, 1)}, before=before,
    )  # fmt: skip


def test_the_link_and_each_member_are_components() -> None:
    link, robot1, robot2 = statuses(robot1=LinkTraffic(2, 90, 7, 1))
    assert (link.name, link.level, link.message) == ("/Fleet/operator", LinkLevel.OK, "connected")
    assert link.values == {"sent": "5", "bytes sent": "50", "dropped": "2", "unsent": "3"}
    assert (robot1.name, robot1.level, robot1.message) == ("/Fleet/operator/robot1", LinkLevel.OK, "present")
    assert robot1.values == {"topics received": "2", "messages": "100", "lost": "7", "malformed": "1"}
    assert robot2.name == "/Fleet/operator/robot2"


def test_new_losses_are_a_warning() -> None:
    _, robot1, robot2 = statuses(robot1=LinkTraffic(2, 90, 4, 0))
    assert (robot1.level, robot1.message) == (LinkLevel.WARN, "3 lost and 1 malformed recently")
    assert robot2.level is LinkLevel.OK


def test_a_link_that_is_down_is_an_error() -> None:
    link = statuses(is_connected=False)[0]
    assert (link.level, link.message) == (LinkLevel.ERROR, "no router is connected")


def test_a_member_that_has_sent_nothing() -> None:
    (link,) = link_statuses("a", is_connected=True, sent=[], received={}, before={})
    assert link.values["sent"] == "0"


# What `pipros doctor` says of fleet agents.


NODE = "/pipros_fleet_robot1"


@pytest.mark.parametrize(("reply", "reasons"), [
    (PluginReply(CHECK, True), []), (PluginReply(CHECK, False), ["no router is connected"]),
    (PluginReply(CHECK, failure="timed out"), ["timed out"]),
])  # fmt: skip
def test_an_agent_without_a_link_is_found(reply: PluginReply, reasons: list[str]) -> None:
    findings = list(CHECK.judge(NODE, reply))

    assert [(finding.rule, finding.subjects) for finding in findings] == [("fleet-link", (NODE,))] * len(
        reasons
    )
    assert [finding.summary.rpartition(": ")[2] for finding in findings] == reasons
    assert CHECK in plugin_checks()

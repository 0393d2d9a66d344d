"""How often a member may ask."""

from pipros_fleet.directory import FLEET_MEMBERS, FLEET_TOPICS
from pipros_fleet.question_pace import FLEET_QUESTIONS, QuestionPace


def test_a_member_that_asks_too_often_takes_no_answers_from_others() -> None:
    now_ns = 1_000_000_000_000
    pace = QuestionPace(lambda: now_ns)
    assert sum(pace.allows("bad") for _ in range(3 * FLEET_TOPICS)) == 2 * FLEET_TOPICS
    assert pace.allows("good")
    now_ns += 1_000_000_000
    assert sum(pace.allows("bad") for _ in range(5 * FLEET_QUESTIONS)) == FLEET_QUESTIONS
    for number in range(FLEET_MEMBERS):
        pace.allows(f"name{number}")
    assert len(pace._due_ns) == FLEET_MEMBERS

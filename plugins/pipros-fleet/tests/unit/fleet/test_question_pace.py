"""How often a member may ask."""

from pipros_fleet.directory import FLEET_MEMBERS, FLEET_TOPICS
from pipros_fleet.question_pace import FLEET_QUESTIONS, QuestionPace


def test_a_member_that_asks_too_often_takes_no_answers_from_others() -> None:
    now_s = 1000.0
    pace = QuestionPace(lambda: now_s)
    assert abs(sum(pace.allows("bad") for _ in range(3 * FLEET_TOPICS)) - 2 * FLEET_TOPICS) <= 1  # rounding
    assert pace.allows("good")
    now_s += 1
    assert abs(sum(pace.allows("bad") for _ in range(5 * FLEET_QUESTIONS)) - FLEET_QUESTIONS) <= 1
    for number in range(FLEET_MEMBERS):
        pace.allows(f"name{number}")
    assert len(pace._due_s) == FLEET_MEMBERS

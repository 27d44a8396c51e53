"""What the report says of people's hours."""

from planner.report.subjects.plan_schedule import people_hours
from planner.report.time_spent import PEOPLE, by_action, by_test
from tests.specs import planned, shared, with_plan

WEEKDAYS = {"days": ["mon", "tue", "fri"], "from": "08:00", "to": "17:00"}
NIGHT = {"days": ["wed"], "from": "22:00", "to": "06:00"}


def plan():
    spec = with_plan(shared(), shifts=[WEEKDAYS, NIGHT | {"start": "fri 16:00"}])
    spec["benches"]["rate_table"]["remove"] = "10 min"
    return planned(spec).plan


def test_the_hours_of_people_are_named_with_what_waiting_for_them_takes():
    """Friday 16:00 to Monday 08:00 is 64 h, of which all but the waiting before remove is work."""
    made = plan()
    (wait,) = [s for s in made.steps if s.action == "pause" and s.test is None]
    text = people_hours(made)
    assert "People are there mon, tue, fri 08:00 to 17:00; wed 22:00 to 06:00" in text
    assert "the campaign begins fri 16:00" in text
    assert f"2 of {len(made.steps)} steps need them" in text
    assert f"takes {(wait.end_s - wait.start_s) / 3600:.2f} h of the benches, in 1 pause." in text


def test_waiting_for_people_has_a_heading_of_its_own():
    made = plan()
    (wait,) = [s for s in made.steps if s.action == "pause" and s.test is None]
    for split in (by_action, by_test):
        found = {spent.name: spent.seconds for spent in split(made.steps, made.time_s)}
        assert found[PEOPLE] == wait.end_s - wait.start_s

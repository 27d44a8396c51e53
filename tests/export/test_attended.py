"""Every step that needs a person is told to one, at a time when one is there."""

from __future__ import annotations

from functools import cache

import icalendar
import pytest

from planner.catalog import exports
from planner.errors import InputError
from planner.export.json import plan_document
from planner.nouns.plan_file import typed_plan
from planner.protocols import ExportOptions
from tests.export.samples import resealed, turning
from tests.specs import planned, small, with_plan

SHIFT = {"days": ["mon", "tue", "wed", "thu", "fri"], "from": "08:00", "to": "17:00"}


@cache
def document(attended: bool | None = True, kind: str = "rate_table", axes: int = 2) -> dict:
    """One test on one bench, three motions a repeat, in shifts."""
    spec = small(requirement=[{"error": "position", "limit": "100 m", "rule": "worst_case"}])
    bench = spec["benches"]["rate_table"] | {"kind": kind, "axes": axes, "move": "1 min", "remove": "20 min"}
    test = spec["tests"]["gyro_drift"] | {"motions": 3, "power_on": "2 min", "bench": "bench"}
    test |= {} if attended is None else {"attended": attended}
    if kind == "centrifuge":
        test["motions"] = [{"acceleration": f"{load} g"} for load in (2, -2, -4)]
        bench["arm"] = "1 m"
    by_hand = {"gyro_drift": {"temperatures": ["-40 degC", "60 degC"], "repeats": 4}}
    spec |= {"benches": {"bench": bench}, "tests": {"gyro_drift": test}}
    return plan_document(planned(with_plan(spec, fixed=by_hand, shifts=SHIFT)).plan)


def exported(plan: dict, **options: str):
    return exports()["ics"].files(plan, ExportOptions(**options))


def events(plan: dict, **options: str) -> list[icalendar.Event]:
    text = exported(plan, **options).files["attended.ics"]
    return list(icalendar.Calendar.from_ical(text).walk("VEVENT"))


def attended_actions(plan: dict) -> list[str]:
    return sorted({step["action"] for step in plan["steps"] if step["attended"]})


def test_a_test_of_peoples_has_an_appointment_a_repeat_and_a_line_a_step():
    plan = document()
    assert attended_actions(plan) == ["install", "move", "power_on", "remove"]
    found = [e for e in events(plan) if str(e["SUMMARY"]) == "Attend gyro_drift: bench"]
    assert len(found) == 8  # 2 temperatures, 4 repeats
    assert "switch on 1 time, attend the move 3 times" in str(found[0]["DESCRIPTION"])
    sheet = exported(plan).files["operator.html"]
    assert sheet.count('<tr class="hand"') == sum(step["attended"] for step in plan["steps"])


def test_a_test_that_runs_by_itself_has_none():
    plan = document(attended=None)
    assert attended_actions(plan) == ["install", "remove"]
    assert [str(e["SUMMARY"]) for e in events(plan)] == ["Install: bench", "Remove: bench"]


def test_faces_are_put_by_people_in_shifts_unless_the_spec_says_that_nobody_does_it():
    plan = document(attended=None, kind="levelled_plate")
    assert attended_actions(plan) == ["install", "move", "remove"]
    assert exported(plan).notes  # the start that was assumed, and nothing that falls outside the shifts
    assert all("outside" not in note for note in exported(plan).notes)
    assert len([e for e in events(plan) if str(e["SUMMARY"]).startswith("Put on its face")]) == 8
    assert attended_actions(document(attended=False, kind="levelled_plate")) == ["install", "remove"]


def test_an_arm_of_one_axis_is_attended_where_the_sign_of_the_load_changes():
    """Loads 2, −2, −4 g: round for the second, and from the third to the first of the next repeat."""
    plan = document(attended=None, kind="centrifuge", axes=1)
    moves = [step for step in plan["steps"] if step["action"] == "move"]
    assert [step["attended"] for step in moves] == [True, True, False] * 8
    turns = [e for e in events(plan) if str(e["SUMMARY"]).startswith("Turn round")]
    assert len(turns) == 8
    # only the very first power-on finds the unit as it was installed
    assert ["2 times" in str(e["DESCRIPTION"]) for e in turns] == [False] + [True] * 7
    assert attended_actions(document(attended=None, kind="centrifuge", axes=2)) == ["install", "remove"]


def test_whatever_is_attended_lies_in_the_shifts_of_the_plan():
    for plan in (document(), document(None, "levelled_plate"), document(None, "centrifuge", 1)):
        windows = [(s["opens_s"], s["closes_s"]) for s in plan["shifts"]]
        assert plan["start"] == "mon 08:00"
        for step in plan["steps"]:
            begin = (8 * 3600 + step["start_s"]) % (7 * 86400)
            lasts = step["end_s"] - step["start_s"]
            assert not step["attended"] or any(
                a - 1e-6 <= begin and begin + lasts <= b + 1e-6 for a, b in windows
            )


def test_a_start_at_which_people_would_be_asked_at_night_is_refused_with_one_that_is_right():
    with pytest.raises(InputError, match=r"is tue 20:00, the shifts were laid from mon 08:00") as caught:
        exported(document(), start="2026-12-01T20:00")
    assert caught.value.exit_code == 2
    assert "start 2026-12-07T08:00, or say 'start: tue 20:00' under plan.shifts" in str(caught.value)
    exported(document(), start="2026-12-07T08:00")


def test_another_start_that_keeps_to_the_shifts_is_taken():
    """Nothing of it lasts till evening: any morning of the week will do that has the night to follow."""
    plan = document()
    end = max(step["end_s"] for step in plan["steps"] if step["attended"])
    assert end < 3 * 86400
    assert exported(plan, start="2026-12-01T08:00", timezone="Europe/Berlin").notes == ()


def test_a_change_of_the_clocks_in_mid_campaign_is_said():
    """Put forward on Sunday 28 March 2027: seven days later by the campaign's clock is an hour late."""
    plan = document()
    steps = [dict(step) for step in plan["steps"]]
    late = [step for step in steps if step["action"] == "remove"]
    late[0].update(start_s=7 * 86400 + 8.5 * 3600, end_s=7 * 86400 + 9 * 3600)  # monday 16:30 to 17:00
    plan = resealed(plan | {"steps": steps, "time_s": late[0]["end_s"]})
    (note,) = exported(plan, start="2027-03-22T08:00", timezone="Europe/Berlin").notes
    assert "the clocks change during the campaign: 1 of" in note
    assert exported(plan, start="2027-03-22T08:00", timezone="UTC").notes == ()


def test_an_older_plan_that_does_not_say_who_attends_is_read_as_before():
    plan = turning({"position_1_deg": 90.0})
    assert all("attended" not in step for step in plan["steps"])
    assert typed_plan(plan).shifts == []
    assert [str(e["SUMMARY"]) for e in events(plan)] == ["Install: table", "Remove: table"]


def test_a_batch_is_named_where_it_is_installed():
    spec = with_plan(small(), units=2)
    spec["benches"]["rate_table"] |= {"remove": "10 min"}
    details = [str(e["DESCRIPTION"]) for e in events(plan_document(planned(spec).plan))]
    assert [text.split(",")[0] for text in details] == ["batch 1", "batch 1", "batch 2", "batch 2"]


def test_a_script_with_waits_for_people_says_when_to_start_it():
    for form in ("acutrol", "chamber"):
        notes = exports()[form].files(document(), ExportOptions("host")).notes
        assert any("start the scripts mon 08:00" in note for note in notes)
        assert all(
            "start" not in note
            for note in exports()[form].files(turning({"rate_1_dps": 9.0}), ExportOptions("host")).notes
        )
    assert any(
        "people attend 32 power-ons and moves" in n
        for n in exports()["acutrol"].files(document(), ExportOptions("host")).notes
    )

"""What a spec may say of shifts, orders, overlap and batches, and what it may not."""

import pytest

from planner.errors import InputError
from planner.spec.attendance import calendar_of, start_of, start_words
from tests.specs import loaded, small, with_plan

HOUR = 3600.0
WEEKDAYS = {"days": ["mon", "tue", "wed", "thu", "fri"], "from": "08:00", "to": "17:00"}


def spec(**plan: object):
    return with_plan(small(), **plan)


def faults(raw: dict) -> list[tuple[str, str]]:
    with pytest.raises(InputError) as caught:
        loaded(raw)
    assert caught.value.exit_code == 2
    assert all(fault.line > 0 for fault in caught.value.faults)
    return [(fault.path, fault.message) for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("plan", "path", "words"),
    [
        ({"order": "sideways"}, "plan.order", "sideways"),
        ({"overlap": ["soak"]}, "plan.overlap[0]", "soak"),
        ({"units": 0}, "plan.units", "less than 1"),
        ({"units": 2.5}, "plan.units", "whole number"),
        ({"trade_off": "yes"}, "plan.trade_off", "true nor false"),
        ({"shifts": WEEKDAYS | {"days": ["mon", "funday"]}}, "plan.shifts.days[1]", "fri"),
        ({"shifts": WEEKDAYS | {"days": []}}, "plan.shifts.days", "at least 1"),
        ({"shifts": {"from": "08:00"}}, "plan.shifts.to", "missing"),
        ({"shifts": WEEKDAYS | {"from": "8 h"}}, "plan.shifts.from", "'08:00'"),
        ({"shifts": WEEKDAYS | {"from": 800}}, "plan.shifts.from", "'08:00'"),
        ({"shifts": WEEKDAYS | {"to": "24:30"}}, "plan.shifts.to", "24:00"),
        ({"shifts": WEEKDAYS | {"to": "08:60"}}, "plan.shifts.to", "time of day"),
        ({"shifts": WEEKDAYS | {"to": "08:00"}}, "plan.shifts.to", "24:00"),
        ({"shifts": WEEKDAYS | {"start": "monday"}}, "plan.shifts.start", "'mon 08:00'"),
        ({"shifts": WEEKDAYS | {"begin": "08:00"}}, "plan.shifts.begin", "unknown key"),
        ({"shifts": WEEKDAYS | {"opens": "08:00"}}, "plan.shifts.opens", "unknown key"),
        (
            {"shifts": [WEEKDAYS | {"start": "mon 08:00"}, WEEKDAYS | {"start": "tue 08:00"}]},
            "plan.shifts[1].start",
            "keep one",
        ),
    ],
)
def test_a_fault_has_its_place_and_a_remedy(plan, path, words):
    (found,) = faults(spec(**plan))
    assert found[0] == path
    assert words in found[1]


def test_installing_that_fits_into_no_shift_is_refused():
    raw = spec(shifts={"from": "08:00", "to": "08:20"})
    raw["benches"]["rate_table"]["remove"] = "25 min"
    assert [path for path, _ in faults(raw)] == ["benches.rate_table.install", "benches.rate_table.remove"]
    assert "0.3333 h" in faults(raw)[0][1]
    raw["benches"]["rate_table"]["attended"] = False
    loaded(raw)


def test_a_move_that_fits_into_no_shift_is_refused():
    raw = spec(shifts={"from": "08:00", "to": "09:00"})
    raw["benches"]["rate_table"]["move"] = "61 min"
    loaded(raw)
    raw["tests"]["gyro_drift"]["attended"] = True
    (fault,) = faults(raw)
    assert fault[0] == "tests.gyro_drift.bench"


def test_a_repeat_that_people_cannot_attend_without_a_pause_is_refused():
    """Six records of 20 min with 10 min between: the last move is 2.5 h after power-on."""
    raw = spec(shifts={"from": "08:00", "to": "10:00"})
    test = raw["tests"]["gyro_drift"]
    test.update(motions=6, record="20 min", gap="10 min", attended=True)
    ((path, message),) = faults(raw)
    assert path == "tests.gyro_drift.attended"
    assert "2.5 h" in message
    raw["plan"]["shifts"]["to"] = "10:30"
    loaded(raw)


def test_faces_that_people_put_are_theirs_unless_the_spec_says_that_they_are_not():
    """On a levelled plate every move is a person's, so the sixth face must still lie in the shift."""
    raw = spec(shifts={"from": "08:00", "to": "10:00"})
    raw["benches"]["rate_table"].update(kind="levelled_plate", move="1 min")
    test = raw["tests"]["gyro_drift"]
    test.update(motions=6, record="20 min", gap="10 min", calibrates=[], temperatures="room", repeats=2)
    raw["tests"]["accelerometer_drift"]["attended"] = False
    raw["unit"]["gyro"] = {}
    raw["sensitivities"]["given"].pop("gyro.bias")
    ((path, message),) = faults(raw)
    assert path == "tests.gyro_drift"
    assert "2.6 h" in message  # six moves of a minute, five records and five gaps before the last one
    assert "'attended: false'" in message
    test["attended"] = False
    loaded(raw)


def test_what_needs_nobody_fits_always():
    raw = spec(shifts={"days": "wed", "from": "08:00", "to": "08:30"})
    raw["tests"]["gyro_drift"].update(record="9 h")
    loaded(raw)


@pytest.mark.parametrize(
    ("shifts", "windows"),
    [
        ({"days": "tue", "from": "8:00", "to": "17:30"}, [(32, 41.5)]),
        ({"days": ["sun"], "from": "22:00", "to": "06:00"}, [(166, 174)]),
        (
            [
                {"days": "mon", "from": "08:00", "to": "12:00"},
                {"days": "mon", "from": "13:00", "to": "17:00"},
            ],
            [(8, 12), (13, 17)],
        ),
        (
            [
                {"days": "mon", "from": "08:00", "to": "24:00"},
                {"days": "tue", "from": "00:00", "to": "02:00"},
            ],
            [(8, 26)],
        ),
    ],
)
def test_shifts_are_hours_of_the_week(shifts, windows):
    found = calendar_of(loaded(spec(shifts=shifts)).spec)
    assert [(a / HOUR, b / HOUR) for a, b in found.windows] == windows


def test_the_campaign_starts_when_the_spec_says_or_with_the_first_shift():
    first = loaded(spec(shifts=WEEKDAYS | {"days": ["wed", "fri"]})).spec
    assert (start_of(first), start_words(first)) == (56 * HOUR, "wed 08:00")
    said = loaded(spec(shifts=WEEKDAYS | {"start": "sun 7:30"})).spec
    assert (start_of(said), start_words(said)) == (151.5 * HOUR, "sun 07:30")
    assert start_words(loaded(small()).spec) is None


def test_yaml_1_2_leaves_times_of_day_as_they_are():
    from pathlib import Path

    from planner.spec.load import spec_from_bytes
    from tests.specs import SHIPPED

    text = (SHIPPED / "small_uav.yaml").read_text()
    assert "\nplan:\n" in text
    text = text.replace(
        "\nplan:\n", "\nplan:\n  shifts: {days: [mon, sat], from: 08:00, to: 17:00, start: mon 08:00}\n"
    )
    (shift,) = spec_from_bytes(text.encode(), Path("spec.yaml")).spec.plan.shifts
    assert (shift.days, shift.opens, shift.closes, shift.start) == (
        ("mon", "sat"),
        8 * HOUR,
        17 * HOUR,
        8 * HOUR,
    )

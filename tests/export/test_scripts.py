"""The scripts for table and chamber: every line in the language, every delay the plan's."""

from __future__ import annotations

import csv
import itertools
import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.catalog import exports
from planner.errors import InputError
from planner.export._scripts import figure, milliseconds, shares_ms
from planner.protocols import ExportOptions
from tests.export import grammar
from tests.export.samples import shipped, small, turning
from tests.shipped_plans import LONG, SAMPLE

ARM = {"centrifuge": 1.0}  # the shipped specs do not say how long it is


def acutrol(document: dict, dialect: str = "host") -> dict[str, str]:
    files = exports()["acutrol"].files(document, ExportOptions(dialect)).files
    return {name: text for name, text in files.items() if name.endswith(".txt")}


def own_steps(document: dict, name: str) -> list[dict]:
    return [step for step in document["steps"] if step["bench"] == name.split(".")[0]]


@pytest.mark.parametrize("name", SAMPLE)
@pytest.mark.further("name", LONG)
def test_every_host_line_is_in_the_language_and_every_step_takes_its_time(name):
    document = shipped(name, **ARM)
    for file, text in acutrol(document).items():
        lines, steps = grammar.host(text), own_steps(document, file)
        assert [line for line, _ in lines[:2]] == [":Interlock:Reset ALL", ":Interlock:Close ALL"]
        assert lines[-1] == (":Mode:Off ALL", 0)
        assert sum(ms for _, ms in lines) == milliseconds(steps[-1]["end_s"]) - milliseconds(
            steps[0]["start_s"]
        )
        begins = dict(zip_starts(lines))
        records = [step for step in steps if step["action"] == "record"]
        assert len(begins) == len(records)
        zero = milliseconds(steps[0]["start_s"])
        for (start, length), step in zip(begins.items(), records, strict=True):
            assert start == milliseconds(step["start_s"]) - zero
            assert start + length == milliseconds(step["end_s"]) - zero


def zip_starts(lines: list[tuple[str, int]]) -> list[tuple[int, int]]:
    """(start, length) of every record, in ms from the script's start."""
    starts = itertools.accumulate((ms for _, ms in lines), initial=0)
    return [(at, ms) for at, (line, ms) in zip(starts, lines, strict=False) if line == "Pusk"]


@pytest.mark.parametrize("name", SAMPLE)
@pytest.mark.further("name", LONG)
def test_macros_are_in_the_language_and_take_as_long_as_the_plan(name):
    document = shipped(name, **ARM)
    files = acutrol(document, "macro")
    for own in {file.split(".")[0] for file in files}:
        lines = grammar.macro([text for file, text in files.items() if file.split(".")[0] == own])
        steps = own_steps(document, own)
        # the plan's times have at most six decimals, the delays three: less than a microsecond each
        assert sum(s for _, s in lines) == pytest.approx(
            steps[-1]["end_s"] - steps[0]["start_s"], abs=1e-3, rel=0
        )
        assert lines[-1][0] == ":Mode:Off ALL"


@pytest.mark.parametrize("name", SAMPLE)
@pytest.mark.further("name", LONG)
@pytest.mark.parametrize("dialect", ["host", "macro"])
def test_an_axis_is_at_zero_rate_before_its_mode_changes(name, dialect):
    for text in acutrol(shipped(name, **ARM), dialect).values():
        lines = [line.split("|")[0] for line in grammar.body(text)]
        turning: dict[str, bool] = {}
        for line in lines:
            header, _, arguments = line.partition(" ")
            if header == ":Demand:Rate":
                axis, rate = arguments.split(",")
                turning[axis] = float(rate) != 0
            elif header.startswith(":Mode"):
                still = turning.values() if arguments == "ALL" else [turning.get(arguments, False)]
                assert not any(still), line


@pytest.mark.parametrize("name", SAMPLE)
@pytest.mark.further("name", LONG)
def test_every_record_has_the_motion_that_the_plan_gives_it(name):
    document = shipped(name, **ARM)
    for file, text in acutrol(document).items():
        found = iter(motions_at_records(grammar.host(text)))
        for step in own_steps(document, file):
            if step["action"] == "record":
                seen = next(found)
                for key, value in (step["motion"] or {}).items():
                    if key == "acceleration_g":  # a = R ω², R = 1 m; six decimals of the rate are sent
                        load = math.radians(seen["rate_1_dps"]) ** 2 / 9.80665
                        assert load == pytest.approx(abs(value), rel=1e-7)
                    else:
                        assert seen[key] == pytest.approx(value, abs=1e-6, rel=0)  # six decimals are sent


def motions_at_records(lines: list[tuple[str, int]]) -> list[dict[str, float]]:
    """What the table does when each record starts, by the names that the plan uses."""
    mode: dict[str, str] = {}
    demand: dict[str, float] = {}
    found = []
    for line, _ in lines:
        header, _, arguments = line.partition(" ")
        if line == ":Mode:Off ALL":
            mode, demand = {}, {}
        elif header.startswith(":Mode"):
            mode[arguments] = header.split(":")[2]
        elif header.startswith(":Demand"):
            axis, value = arguments.split(",")
            quantity = header.split(":")[2]
            assert mode[axis] == quantity, line
            demand[f"{quantity.lower()}_{axis}_{'deg' if quantity == 'Position' else 'dps'}"] = float(value)
        elif line == "Pusk":
            found.append(dict(demand))
    return found


def test_the_published_forms_of_the_lines():
    text = acutrol(turning({"position_2_deg": 90, "rate_1_dps": -50}))["table.table.txt"]
    assert grammar.body(text) == [
        ":Interlock:Reset ALL|200",
        ":Interlock:Close ALL|200",
        ":Limit:Rate p,1,600|200",
        ":Limit:Rate r,1,600|200",
        ":Limit:Rate p,2,600|200",
        ":Limit:Rate r,2,600|200",
        ":Limit:Acceleration p,1,500|200",
        ":Limit:Acceleration r,1,500|200",
        ":Limit:Acceleration p,2,500|200",
        ":Limit:Acceleration r,2,500|200",
        ":Mode:Off ALL|598000",
        "Power ON|30000",
        ":Mode:Position 2|200",
        ":Demand:Position 2,90|200",
        ":Mode:Rate 1|200",
        ":Demand:Rate 1,-50|4400",
        "Pusk|20000",
        "Power OFF|0",
        ":Demand:Rate 1,0|300",  # 50 deg/s at 500 deg/s² is 100 ms, and the pace of the script
        ":Mode:Off ALL|59700",
        ":Mode:Off ALL|300000",
        ":Mode:Off ALL|0",
    ]


def test_the_macro_of_the_same_plan():
    text = acutrol(turning({"rate_1_dps": -50}, axes=1), "macro")["table.macro.txt"]
    assert grammar.body(text)[6:] == [
        ":Mode:Off ALL",
        "Delay 600",
        "Delay 30",
        ":Mode:Rate 1",
        ":Demand:Rate 1,-50",
        "Delay 5",
        "Delay 20",
        ":Demand:Rate 1,0",
        "Delay 0.3",
        ":Mode:Off ALL",
        "Delay 59.7",
        ":Mode:Off ALL",
        "Delay 300",
        ":Mode:Off ALL",
    ]


def test_a_move_without_time_of_its_own_is_made_in_the_wait_before_it():
    free = {"limits": {"rate_dps": None, "angular_acceleration_dps2": None, "acceleration_g": None}}
    lines = grammar.host(acutrol(turning({"position_1_deg": 90}, move=0.0, **free))["table.table.txt"])
    start = lines.index(("Power ON", 0))
    assert lines[start : start + 5] == [
        ("Power ON", 0),
        (":Mode:Off ALL", 20_000),
        (":Mode:Position 1", 200),
        (":Demand:Position 1,90", 9_800),
        ("Pusk", 20_000),
    ]


def test_an_arm_stands_while_the_unit_is_turned_round():
    facts = {"kind": "centrifuge", "axes": 1, "arm_m": 1.0, "chamber": None}
    facts["limits"] = {"rate_dps": None, "angular_acceleration_dps2": None, "acceleration_g": 100}
    made = exports()["acutrol"].files(
        turning({"acceleration_g": -1}, move=60.0, **facts), ExportOptions("host")
    )
    lines = grammar.host(made.files["table.table.txt"])
    at = lines.index(("Pusk", 20_000))
    assert lines[at - 3 : at] == [
        (":Mode:Off ALL", 50_000),
        (":Mode:Rate 1", 200),
        (f":Demand:Rate 1,{math.degrees(9.80665**0.5):.6f}", 9_800),  # a = R ω²
    ]
    assert any("a person turns the unit 1 times" in note for note in made.notes)


def test_a_wait_between_steps_is_kept():
    document = small([("install", 600.0, {}), ("remove", 60.0, {"start_s": 50_000.0, "end_s": 50_060.0})])
    lines = grammar.host(acutrol(document)["table.table.txt"])
    assert sum(ms for _, ms in lines) == 50_060_000


def test_a_bench_without_drive_or_arm_gets_no_script_and_is_named():
    document = shipped("high_g", centrifuge=None)
    made = exports()["acutrol"].files(document, ExportOptions("host"))
    assert sorted(made.files) == ["rate_table.setpoints.csv", "rate_table.table.txt"]
    assert [note for note in made.notes if note.startswith("no script for centrifuge")]
    with pytest.raises(InputError, match="no bench of this plan can have a table script"):
        acutrol(turning({"position_1_deg": 90}, kind="levelled_plate"))


def test_long_macros_are_split_into_messages_that_go_on_where_the_last_one_stopped():
    document = shipped("published_one_bench")
    files = acutrol(document, "macro")
    assert len(files) > 1
    parts = [grammar.body(text) for text in files.values()]
    assert all(len(text.encode()) <= 32_000 for text in files.values())
    assert parts[0][0] == ":Interlock:Reset ALL"
    assert sum(line == ":Interlock:Reset ALL" for part in parts for line in part) == 1
    assert list(files) == sorted(files)


@pytest.mark.parametrize("name", SAMPLE)
@pytest.mark.further("name", LONG)
def test_the_chamber_script_holds_every_step_at_its_temperature(name):
    document = shipped(name)
    files = exports()["chamber"].files(document, ExportOptions("host")).files
    for file, text in files.items():
        steps = own_steps(document, file)
        if not file.endswith(".txt"):
            continue
        lines = grammar.chamber(text)
        assert [line for line, _ in lines[:2]] == ["POWER,ON", "MODE,CONSTANT"]
        assert sum(ms for _, ms in lines) == milliseconds(steps[-1]["end_s"]) - milliseconds(
            steps[0]["start_s"]
        )
        assert [line for line, _ in lines if line.startswith("TEMP,S")][-1] == "TEMP,S20.0"
        for step in steps:
            if step["action"] == "record":
                at = milliseconds(step["start_s"]) - milliseconds(steps[0]["start_s"])
                # the controller knows tenths of a degree
                assert setpoint_at(lines, at) == pytest.approx(step["temperature_degc"], abs=0.05 + 1e-9)


def setpoint_at(lines: list[tuple[str, int]], ms: int) -> float:
    clock, found = 0, float("nan")
    for line, delay in lines:
        if clock > ms:
            break
        if line.startswith("TEMP,S"):
            found = float(line[6:])
        clock += delay
    return found


@pytest.mark.parametrize("name", SAMPLE)
@pytest.mark.further("name", LONG)
def test_setpoints_follow_one_another_without_gap_and_are_soaked_before_a_record(name):
    document = shipped(name)
    files = exports()["acutrol"].files(document, ExportOptions("host")).files
    rows = list(csv.DictReader(files["rate_table.setpoints.csv"].splitlines()))
    steps = own_steps(document, "rate_table")
    assert float(rows[0]["start_s"]) == steps[0]["start_s"]
    assert all(a["end_s"] == b["start_s"] for a, b in itertools.pairwise(rows))
    for step in steps:
        if step["action"] == "record":
            row = next(r for r in rows if float(r["start_s"]) <= step["start_s"] < float(r["end_s"]))
            assert float(row["setpoint_degc"]) == pytest.approx(step["temperature_degc"], abs=1e-6)
            assert float(row["soaked_s"]) <= step["start_s"] + 1e-6


@given(st.lists(st.integers(0, 5000), min_size=1, max_size=8), st.integers(0, 20_000))
@settings(deadline=None, max_examples=200)
def test_shares_of_a_time_add_up_to_it_and_none_is_negative(wanted, ms):
    found = shares_ms(wanted, ms)
    assert sum(found) == ms
    assert min(found) >= 0
    assert all(got <= want for got, want in zip(found[:-1], wanted[:-1], strict=True))


@given(st.floats(-1e6, 1e6))
@settings(deadline=None, max_examples=200)
def test_figures_read_back_and_are_in_the_grammar(value):
    text = figure(value)
    assert re.fullmatch(grammar.NUMBER, text)
    assert float(text) == pytest.approx(value, abs=5.1e-7)  # six decimals
    assert text != "-0"


def test_two_exports_of_one_plan_are_the_same_bytes():
    document = shipped("high_g", **ARM)
    for name, form in exports().items():
        for dialect in form.dialects or (None,):
            options = ExportOptions(dialect)
            assert form.files(document, options) == form.files(document, options), name


def test_every_file_of_every_format_carries_the_hashes_and_the_version():
    document = shipped("high_g", **ARM)
    for name, form in exports().items():
        for dialect in form.dialects or (None,):
            for file, content in form.files(document, ExportOptions(dialect)).files.items():
                text = content.decode().replace("\r\n ", "") if isinstance(content, bytes) else content
                if file == "plan.schema.json":
                    continue  # of all plans alike
                assert document["plan_sha256"] in text, (name, file)
                assert document["spec"]["sha256"] in text, (name, file)
                assert "schema_version" in text.lower().replace("-", "_"), (name, file)


def test_the_benches_limits_are_sent_for_every_axis_and_mode():
    limits = {"rate_dps": 300.5, "angular_acceleration_dps2": None, "acceleration_g": None}
    text = acutrol(turning({"rate_1_dps": 300}, axes=2, limits=limits))["table.table.txt"]
    sent = [line.split("|")[0] for line in grammar.body(text) if line.startswith(":Limit")]
    assert sent == [f":Limit:Rate {mode},{axis},300.5" for axis in (1, 2) for mode in "pr"]

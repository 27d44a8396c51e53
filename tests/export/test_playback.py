"""The scripts, played on the bench simulator: nothing refused, and the axes do what the plan says."""

from __future__ import annotations

import math

import pytest

from planner.bench_run.simulator.chamber import Chamber
from planner.bench_run.simulator.table import Table
from planner.catalog import exports
from planner.protocols import ExportOptions
from tests.bench_run.memory_line import VirtualClock
from tests.export import grammar
from tests.export.samples import shipped
from tests.shipped_plans import LONG, SAMPLE

STILL_DPS = 1e-6  # the simulator sums its pieces of motion over days: 1e-8 deg/s is left
HOST_WORDS = ("Power ON", "Power OFF", "Pusk")


@pytest.mark.parametrize("name", SAMPLE)
@pytest.mark.further("name", LONG)
def test_the_table_obeys_every_line_and_records_see_the_planned_motion(name):
    document = shipped(name, centrifuge=1.0)
    files = exports()["acutrol"].files(document, ExportOptions("host")).files
    for file, text in files.items():
        if not file.endswith(".table.txt"):
            continue
        bench = file.split(".")[0]
        records = [s for s in document["steps"] if s["bench"] == bench and s["action"] == "record"]
        clock, done = VirtualClock(), iter(records)
        table = Table(clock, axes=document["benches"][bench]["axes"])
        for line, ms in grammar.host(text):
            if line == "Pusk":
                check_motion(table, clock.now(), ms / 1000, next(done)["motion"] or {})
            elif line not in HOST_WORDS:
                assert table.receive(line) is None
            clock.sleep(ms / 1000)
        assert table.refusals == []
        assert next(done, None) is None
        assert all(abs(table.at(axis).rate_dps) < STILL_DPS for axis in range(1, table.axes + 1))


def check_motion(table: Table, start: float, seconds: float, motion: dict) -> None:
    """From the record's start to its end: held positions and steady rates to what the script's digits say."""
    for key, value in motion.items():
        axis = 1 if key == "acceleration_g" else int(key.split("_")[1])
        first, last = (table.at(axis, t) for t in (start, start + seconds))
        if key.startswith("position"):
            assert (first.position_deg - value + 180) % 360 - 180 == pytest.approx(0, abs=1e-5)
            assert max(abs(first.rate_dps), abs(last.rate_dps)) < STILL_DPS
        elif key.startswith("rate"):
            assert [first.rate_dps, last.rate_dps] == pytest.approx([value] * 2, abs=STILL_DPS)
        else:
            load = math.radians(last.rate_dps) ** 2 / 9.80665  # a = R ω², R = 1 m
            assert first.rate_dps == pytest.approx(last.rate_dps, abs=STILL_DPS)
            assert load == pytest.approx(abs(value), rel=1e-7)  # six decimals of the rate are sent


@pytest.mark.parametrize("name", SAMPLE)
@pytest.mark.further("name", LONG)
def test_the_chamber_obeys_every_line_and_is_there_when_a_record_starts(name):
    document = shipped(name)
    files = exports()["chamber"].files(document, ExportOptions("host")).files
    text = files["rate_table.chamber.txt"]
    steps = [s for s in document["steps"] if s["bench"] == "rate_table"]
    clock = VirtualClock()
    facts = document["benches"]["rate_table"]["chamber"]
    rates = {k: facts[f"{k}_k_per_min"] or 600.0 for k in ("heating", "cooling")}  # null: at once
    chamber = Chamber(clock, **rates)
    for line, ms in grammar.chamber(text):
        assert not chamber.receive(line).startswith("NA")
        clock.sleep(ms / 1000)
    for step in steps:
        if step["action"] == "record":
            # tenths of a degree in the script; the air settles exponentially in the simulator
            here = chamber.at(step["start_s"] - steps[0]["start_s"])
            assert here == pytest.approx(step["temperature_degc"], abs=0.06)

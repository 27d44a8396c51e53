"""A simulated bench in this process and a small campaign for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import pytest

from planner.bench_run.equipment import BenchLines, Equipment
from planner.bench_run.errors import BenchFault
from planner.bench_run.job import Job, job_from
from planner.bench_run.journal import Journal, open_journal
from planner.bench_run.runner import execute
from planner.bench_run.simulator.chamber import Chamber
from planner.bench_run.simulator.faults import Faulty, fault_from_text
from planner.bench_run.simulator.table import Table
from planner.control.orders import orders
from planner.export.json import plan_document
from planner.nouns.bench import BenchFacts
from planner.nouns.step import Step
from tests.bench_run.memory_line import MemoryLine, VirtualClock
from tests.specs import planned, small

RATE_DPS, ACCELERATION_DPS2 = 600.0, 500.0


@cache
def small_document() -> dict:
    """Two temperatures, two tests of two repeats: rests, turns, power cycles, ramps and soaks."""
    motions = [
        {"position_1": "0 deg", "position_2": "90 deg"},
        {"position_1": "270 deg", "position_2": "180 deg"},
        {"position_2": "0 deg", "rate_1": "-200 deg/s"},
    ]
    test = {"bench": "rate_table", "record": "60 s", "gap": "5 s", "power_on": "30 s", "motions": motions}
    bench = small()["benches"]["rate_table"] | {
        "axes": 2,
        "move": "5 s",
        "remove": "10 min",
        "limits": {"rate": f"{RATE_DPS} deg/s", "angular_acceleration": f"{ACCELERATION_DPS2} deg/s/s"},
    }
    fixed = {"temperatures": ["-40 degC", "25 degC", "60 degC"], "repeats": 2}
    spec = small(
        benches={"rate_table": bench},
        tests={
            "gyro_drift": test | {"calibrates": ["gyro.bias"], "cool_down": "10 min"},
            "accelerometer_drift": test | {"calibrates": ["accelerometer.bias"]},
        },
        requirement=[{"error": "position", "limit": "100 m", "rule": "worst_case"}],
    )
    spec["plan"] = spec["plan"] | {"fixed": {"gyro_drift": fixed, "accelerometer_drift": fixed}}
    return plan_document(planned(spec).plan)


@dataclass
class Sampler:
    """A recorder that looks at the true state of the bench while it records."""

    rig: Rig
    made: list[tuple[str, float, float, int]] = field(default_factory=list)
    void: list[str] = field(default_factory=list)
    powered: list[tuple[bool, int]] = field(default_factory=list)
    lost_ones: list[str] = field(default_factory=list)
    _start: tuple[float, int] = (0.0, 0)

    def power(self, on: bool, step: Step, number: int) -> None:
        self.powered.append((on, number))

    def start(self, step: Step, number: int) -> None:
        self._start = (self.rig.clock.now(), number)

    def stop(self, step: Step, complete: bool) -> None:
        if complete:
            self.made.append((step.id, self._start[0], self.rig.clock.now(), self._start[1]))
        else:
            self.void.append(step.id)

    def lost(self, step: Step, number: int) -> None:
        self.lost_ones.append(step.id)


class Rig:
    """Table, chamber, their lines and a clock; faults as `bench-simulator` takes them."""

    def __init__(self, *faults: str, axes: int = 3, travel: tuple = ()) -> None:
        found = [fault_from_text(text) for text in faults]
        self.clock = VirtualClock()
        self.table = Table(self.clock, axes, travel=travel)
        self.chamber = Chamber(self.clock)
        table_faults = [f for f in found if f.device == "table"]
        self.table_line = MemoryLine(Faulty(self.table, table_faults, self, self.clock.now), self.clock)
        chamber_faults = [f for f in found if f.device == "chamber"]
        self.chamber_line = MemoryLine(Faulty(self.chamber, chamber_faults, self, self.clock.now), self.clock)
        self.recorder = Sampler(self)
        self.said: list[str] = []
        self.left: list = []
        self.disk_is_full = False

    def suspend(self, seconds: float) -> None:
        """The client is stopped, and its next wait takes longer."""
        self.clock.sleep(seconds)

    def fill_disk(self) -> None:
        self.disk_is_full = True

    def equipment(self, job: Job, **changes: object) -> Equipment:
        given = {
            "benches": dict.fromkeys(job.used_benches, BenchLines(self.table_line, self.chamber_line)),
            "clock": self.clock,
            "recorder": self.recorder,
        }
        return Equipment(**(given | changes))

    def run(self, job: Job, journal: Path, *, resume: bool = False, before=lambda step: None, **changes):
        opened = opened_journal(job, journal, resume=resume)
        opened.append = self._full_or(opened.append)
        try:
            equipment = self.equipment(job, **changes)
            return execute(job, equipment, opened, self.said.append, before, self.left.append)
        finally:
            opened.close()

    def _full_or(self, append):
        def appended(line):
            if self.disk_is_full:
                raise BenchFault("cannot write run.jsonl: No space left on device; make room, then --resume")
            append(line)

        return appended

    def is_safe(self) -> bool:
        """Table servoed to zero rate (braking or there), chamber on its way to the room."""
        self.clock.sleep(60.0)
        axes = range(1, self.table.axes + 1)
        still = all(self.table.at(axis).rate_dps == 0 and self.table.mode(axis) == "off" for axis in axes)
        return still and self.chamber.setpoint_degc == 20.0


def small_job() -> Job:
    return job_from(small_document())


def opened_journal(job: Job, path: Path, *, resume: bool = False) -> Journal:
    steps = [step.id for step in job.steps]
    return open_journal(path, job.plan_sha256, steps, resume=resume, from_start=resume and not path.exists())


def compare(rig: Rig, bench: BenchFacts, step: Step, start: float, end: float, late_s: float = 1e-6) -> None:
    """A record as the plan says: its length, and at every moment its temperature, angles and rates."""
    assert end - start == pytest.approx(step.seconds, abs=late_s)
    for time in (start, (start + end) / 2, end):
        if bench.chamber is not None:  # tenths of the controller, and the runner's tolerance of settling
            assert rig.chamber.at(time) == pytest.approx(step.temperature_degc, abs=0.5 + 0.05)
        for order in orders(step.motion, bench):
            position, rate = rig.table.at(order.axis, time)
            if order.mode == "rate":  # 1e-6 deg/s is the last digit that is sent
                assert rate == pytest.approx(order.value, abs=1e-5 + 1e-4 * abs(order.value) + 0.01)
            else:
                off = math.remainder(position - order.value, 360.0)
                assert abs(off) <= 0.01
                assert rate == pytest.approx(0.0, abs=0.5)

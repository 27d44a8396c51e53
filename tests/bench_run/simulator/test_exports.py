"""Exported table scripts, played line by line: nothing refused, and the records of the plan are seen."""

import math

import pytest

from planner.bench_run.simulator.table import Table
from planner.control.orders import orders
from planner.export.formats.acutrol import FORMAT
from planner.protocols import ExportOptions
from tests.bench_run.memory_line import VirtualClock
from tests.bench_run.rig import small_document, small_job
from tests.bench_run.script import play


@pytest.mark.parametrize("dialect", ["host", "macro"])
def test_a_script_is_played_without_a_refusal(dialect):
    files = FORMAT.files(small_document(), ExportOptions(dialect=dialect)).files
    scripts = [text for name, text in sorted(files.items()) if name.endswith(".txt")]
    assert scripts
    clock = VirtualClock()
    table = Table(clock, 2)
    for text in scripts:
        list(play(text, table, clock))
    assert table.refusals == []


def test_at_every_record_the_host_script_has_the_table_where_the_plan_wants_it():
    (text,) = (
        t
        for n, t in FORMAT.files(small_document(), ExportOptions(dialect="host")).files.items()
        if n.endswith(".table.txt")
    )
    clock = VirtualClock()
    table = Table(clock, 2)
    job = small_job()
    records = [step for step in job.steps if step.action == "record"]
    words = [word for word in play(text, table, clock) if word.text == "Pusk"]
    assert [word.delay_s for word in words] == [step.end_s - step.start_s for step in records]
    for step, word in zip(records, words, strict=True):
        for order in orders(step.motion, job.benches[step.bench]):
            for time in (word.time_s, word.time_s + word.delay_s):
                position, rate = table.at(order.axis, time)
                if order.mode == "rate":
                    assert rate == pytest.approx(order.value, abs=1e-6)
                else:
                    assert abs(math.remainder(position - order.value, 360.0)) < 1e-6

import math

import pytest

from planner.bench_run.simulator.faults import InjectedFault, fault_from_text
from planner.bench_run.simulator.server import SimulatedBench
from planner.errors import InputError


def test_faults_are_read():
    assert fault_from_text("lost_reply@12") == InjectedFault("table", "lost_reply", 12, 12)
    assert fault_from_text("chamber.never_settles@3+") == InjectedFault(
        "chamber", "never_settles", 3, math.inf
    )
    assert fault_from_text("late_reply:1.5@3..7") == InjectedFault("table", "late_reply", 3, 7, 1.5)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "lost_reply",
        "lost_reply@0",
        "lost_reply@x",
        "never_settles@1",
        "chamber.stuck_axis@1",
        "late_reply:1.2.3@4",
        "lost_reply:3@4",
    ],
)
def test_what_is_no_fault_is_told_what_is_one(text):
    with pytest.raises(ValueError, match="lost_reply@120"):
        fault_from_text(text)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.1", "::", "example.com", ""])
def test_it_listens_on_this_machine_only(host):
    with pytest.raises(InputError, match="this machine only"):
        SimulatedBench(host=host)

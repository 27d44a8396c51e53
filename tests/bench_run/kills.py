"""kill -9 at random moments of a campaign, again and again, and what must hold at the end."""

from __future__ import annotations

import json
import os
import random
import signal
import time
from pathlib import Path

from planner.bench_run.job import Job
from planner.bench_run.runner import execute
from planner.nouns.plan import Step
from tests.bench_run.rig import Rig, opened_journal, small_job


class FileRecorder:
    """Raw data: one line in a file for every record that was stopped as complete."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        self._number = 0

    def power(self, on: bool, step: Step, number: int) -> None:
        self._number = number if on else 0

    def start(self, step: Step, number: int) -> None:
        assert number == self._number, "a record without power"

    def stop(self, step: Step, complete: bool) -> None:
        os.write(self._file, f"{step.id} {self._number}\n".encode())

    def lost(self, step: Step, number: int) -> None:
        os.write(self._file, f"void {step.id} {number}\n".encode())


def one_life(job: Job, folder: Path, longest_s: float, rng: random.Random) -> bool:
    """A process that runs the campaign on and is killed at a random moment; whether it finished before."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            rig, journal = Rig(), opened_journal(job, folder / "run.jsonl", resume=True)
            slow = rng.random() * 2e-3  # so that kills fall at other places of the steps too
            equipment = rig.equipment(job, recorder=FileRecorder(folder / "raw.txt"))
            execute(job, equipment, journal, before=lambda step: time.sleep(slow))
            code = 0
        finally:
            os._exit(code)
    time.sleep(rng.random() * longest_s)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    if os.WIFEXITED(status):
        assert os.WEXITSTATUS(status) == 0, "the runner failed instead of being killed"
        return True
    return False


def campaign_with_kills(folder: Path, kills: int, seed: int, longest_s: float = 0.15) -> int:
    """Kill runners until `kills` have died, over as many campaigns as that takes; finish and check each.

    longest_s: of a life; long enough that it makes some steps before it dies
    """
    rng, job, dead, campaigns = random.Random(seed), small_job(), 0, 0
    while dead < kills:
        here = folder / f"campaign{campaigns}"
        here.mkdir()
        while dead < kills and not one_life(job, here, longest_s, rng):
            dead += 1
        while not one_life(job, here, 60.0 * longest_s + 5.0, rng):
            dead += 1
        check(job, here)
        campaigns += 1
    return campaigns


def check(job: Job, folder: Path) -> None:
    """No torn line, no step twice, none lost; every record's raw data are there, from a powered unit."""
    text = (folder / "run.jsonl").read_text()
    lines = [json.loads(line) for line in text.splitlines()]
    assert text.endswith("\n")
    assert [line["step"] for line in lines if "step" in line] == [step.id for step in job.steps]
    raw = set((folder / "raw.txt").read_text().splitlines())
    records = {step.id for step in job.steps if step.action == "record"}
    made = [f"{line['step']} {line['power_on']}" for line in lines if line.get("step") in records]
    assert len(made) == len(records)
    assert set(made) <= raw

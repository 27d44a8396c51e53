"""Flights of a verification: nonlinear flights a second against python-ins in a loop, campaigns on two cores.

Run as `python benchmarks/bench_flights.py [FLIGHTS] [--workers]`; with --workers only their efficiency is
measured. Asserted before any time: python-ins finds the same errors for the same corrected readings to 0.1 %
of the largest; every number of workers finds the same to the last bit. Numba's compilation is not counted.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from bench_sensitivities import python_ins_run
from pyins import transform

from planner.export.json import plan_document
from planner.nouns.array import Array
from planner.pipelines.planning import exact_plan
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.load import load_spec
from planner.verify.experiment import CHUNK, Experiment, experiment, units_left
from planner.verify.flights import exact_coefficients
from planner.verify.monte_carlo import MonteCarlo, fly
from planner.verify.workers import runner

SPEC = Path(__file__).parents[1] / "requirements_specs/small_uav.yaml"
LEAST_RATIO = 100.0
FEW = 10
ROUNDS = 10  # chunks that each of four workers has


def prepared() -> Experiment:
    loaded = load_spec(SPEC)
    trajectory = trajectory_of(loaded.spec.trajectory, loaded.folder)
    return experiment(plan_document(exact_plan(loaded)), loaded.spec, trajectory, seed=1)


def theirs(e: Experiment, coefficients: Array) -> tuple[float, Array]:
    """Seconds a flight, and position errors (B, 3), of python-ins on the same corrected readings."""
    assert e.flight is not None
    t = e.flight.trajectory
    columns = [np.concatenate(parts, axis=2) for parts in e.flight.columns.forcing(0, len(t.angle_increment))]
    split, step = columns[0].shape[2], t.time_s[1] - t.time_s[0]
    readings = [
        (
            t.angle_increment + step * (columns[0] @ c[:split]),
            t.velocity_increment + step * (columns[1] @ c[split:]),
        )
        for c in coefficients
    ]
    clean = python_ins_run(t, t.angle_increment, t.velocity_increment)
    start = time.perf_counter()
    ends = [python_ins_run(t, *pair) for pair in readings]
    spent = (time.perf_counter() - start) / len(ends)
    off = [transform.compute_state_difference(end, clean) for end in ends]
    return spent, np.array([[d["north"], d["east"], -d["down"]] for d in off])


def of_flights(e: Experiment) -> float:
    """Ratio of a flight's time by python-ins in a loop to ours."""
    assert e.flight is not None
    coefficients = np.concatenate([exact_coefficients(e.flight, units_left(e, k)) for k in range(50)])
    each, expected = theirs(e, coefficients[:FEW])
    found = e.flight.navigate(coefficients[:FEW]).position[-1].T
    off = np.abs(found - expected).max() / np.linalg.norm(expected, axis=1).max()
    assert off < 1e-3, f"errors differ by {off:.1e}"
    start = time.perf_counter()
    e.flight.navigate(coefficients)
    ours = (time.perf_counter() - start) / len(coefficients)
    print(f"a flight of 60 s at 100 Hz; errors agree to {off:.1e} of the largest")
    print(f"  python-ins in a loop  {1 / each:10.1f} flights/s")
    print(f"  planner, {len(coefficients)} at once {1 / ours:10.1f} flights/s   {each / ours:.0f} times")
    return each / ours


def flown(e: Experiment, flights: int, workers: int) -> tuple[float, MonteCarlo]:
    start = time.perf_counter()
    found: Any = fly(e, flights, runner(workers, None), lambda message: None)
    return time.perf_counter() - start, found


def of_workers(e: Experiment) -> None:
    """Efficiency of 1, 2, 4 workers, on so many chunks that none waits long for the last one."""
    flights = ROUNDS * 4 * CHUNK
    reference = flown(e, 4 * CHUNK, 1)[1]
    for workers in (2, 4):
        other = flown(e, 4 * CHUNK, workers)[1]  # also starts the workers, which is not counted below
        assert np.array_equal(other.tally.lengths, reference.tally.lengths), "workers change the result"
    print(f"campaign of {len(e.records)} records, calibration and flight; the same bits for 1, 2, 4 workers")
    spent = {workers: flown(e, flights, workers)[0] for workers in (1, 2, 4)}
    for workers, seconds in spent.items():
        busy = spent[1] / (seconds * workers)
        print(f"  {workers} workers {flights / seconds:8.0f} campaigns/s   efficiency {busy:.0%}")
    load()


def of_campaigns(e: Experiment, flights: int) -> None:
    """Campaign, calibration and flight on two workers; memory."""
    spent, found = flown(e, flights, 2)
    here, worker = (
        resource.getrusage(who).ru_maxrss / 1024 for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    print(f"  {found.tally.flights} campaigns with flights on 2 workers: {spent:.1f} s")
    print(f"  peak memory {here:.0f} MB here, {worker:.0f} MB a worker")
    load()


def load() -> None:
    print(f"  {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}: what others take is missing above")


def main() -> int:
    e = prepared()
    numbers = [int(word) for word in sys.argv[1:] if word != "--workers"]
    if "--workers" in sys.argv:
        of_workers(e)
        return 0
    ratio = of_flights(e)
    of_workers(e)
    of_campaigns(e, numbers[0] if numbers else 10_000)
    return 0 if ratio >= LEAST_RATIO else 1


if __name__ == "__main__":
    sys.exit(main())

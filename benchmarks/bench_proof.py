"""The proof of the plan: gap 0 for 20 choices of temperatures, 6 errors and 40 numbers of repeats in seconds.

First the answers: on small problems of the same make the optimum equals that of an exhaustive search, for
several seeds; on the large one the program claims gap 0, the plan keeps its limit, and its cost is counted
again. Then the time, and how it grows with temperatures, errors and repeats.

    python benchmarks/bench_proof.py
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).parents[1]))  # the benches are the tests' own

from planner.nouns.choices import Campaign
from planner.pipelines import navigation
from planner.plan.repeats_to_schedule import campaign
from planner.plan.task import Task
from planner.spec.load import spec_from_bytes
from tests.specs import small

ERRORS = ("bias", "scale_factor", "scale_factor_asymmetry")  # of both sensors: six
UNITS = {"bias": ("deg/s", "g"), "scale_factor": ("%", "%"), "scale_factor_asymmetry": ("%", "%")}
LARGE = {"temperatures": 20, "errors": 6, "repeats": 40}
LARGEST_SECONDS = 30.0
SEEDS = (1, 2, 3, 4, 5)


def synthetic(temperatures: int, errors: int, repeats: int, seed: int) -> dict[str, Any]:
    """A spec with given coefficients: every error has a test of its own, in which it has its own points.

    The limit lies a fifth of the way from the least that the bench can reach to the most.
    """
    dice = np.random.default_rng(seed)
    names = [(s, e) for e in ERRORS for s in ("gyro", "accelerometer")][:errors]
    candidates = sorted({1 + round(i * 24 / temperatures) for i in range(temperatures)})
    unit: dict[str, Any] = {"gyro": {}, "accelerometer": {}}
    given, tests, least, most = {}, {}, 0.0, 0.0
    for sensor, effect in names:
        size = UNITS[effect][sensor == "accelerometer"]
        spread, residual, weight = dice.uniform(0.5, 2.0, 3)
        table = {n: residual * 8.0 / n**1.3 for n in candidates}
        unit[sensor][effect] = {
            "systematic": f"{10 * residual:.9f} {size}",
            "run_to_run": f"{spread:.9f} {size}",
            "temperature_residual": {n: f"{value:.9f} {size}" for n, value in table.items()},
        }
        per = f"m/({size})" if "/" in size else f"m/{size}"
        given[f"{sensor}.{effect}"] = f"{weight:.9f} {per}"
        tests[f"{sensor}_{effect}"] = {
            "bench": "rate_table",
            "calibrates": [f"{sensor}.{effect}"],
            "record": f"{dice.integers(20, 400)} s",
            "gap": f"{dice.integers(1, 900)} s",
            "motions": int(dice.integers(1, 12)),
        }
        least += weight * (spread + table[candidates[-1]] + 1.96 * spread / np.sqrt(repeats + 1))
        most += weight * (spread + table[candidates[0]] + 1.96 * spread / np.sqrt(2))
    return {
        "planner": 1,
        "name": f"synthetic {temperatures} x {errors} x {repeats}",
        "requirement": [{"error": "position", "limit": f"{least + 0.2 * (most - least):.6f} m"}],
        "trajectory": "static",
        "sensitivities": {"given": given},
        "unit": unit,
        "effects": [*ERRORS, "bias_temperature", "scale_factor_temperature"],
        "benches": small()["benches"],
        "tests": tests,
        "plan": {
            "quantile": "normal",
            "temperatures": {"range": ["-60 degC", "60 degC"], "candidates": candidates},
            "repeats": {"least": 2, "most": repeats + 1},
        },
    }


def task_of(document: dict[str, Any]) -> Task:
    loaded = spec_from_bytes(yaml.safe_dump(document, sort_keys=False).encode(), Path("synthetic.yaml"))
    return navigation.task_of(loaded.spec, navigation.navigate(loaded, lambda message: None))


def timed(task: Task) -> tuple[Campaign, float]:
    begin = time.perf_counter()
    found = campaign(task)
    return found, time.perf_counter() - begin


def counted_again(task: Task, found: Campaign) -> float:
    """Cost of a campaign from its visits alone: installation, soaks, one ramp up and down, records."""
    spec = task.spec
    bench, room = spec.benches["rate_table"], spec.plan.temperatures.room
    chamber = bench.chamber
    assert chamber is not None
    assert chamber.heating is not None
    assert chamber.cooling is not None
    places = {t for visit in found.visits for t in visit.temperatures_degc}
    reach = max(places | {room}) - min(places | {room})
    total = bench.install + len(places) * chamber.soak + reach * (1 / chamber.heating + 1 / chamber.cooling)
    for visit in found.visits:
        test = spec.tests[visit.test]
        total += sum(visit.repeats) * test.motion_count * (test.record + test.gap)
    return total


def cheapest_of_all(task: Task) -> float:
    """Exhaustive search over every combination of rows."""
    best = np.inf
    for rows in itertools.product(*(range(len(group.cost)) for group in task.problem.groups)):
        if task.problem.within_limits(rows):
            best = min(best, task.problem.cost(rows))
    return best


def check_against_exhaustive_search() -> None:
    for seed in SEEDS:
        task = task_of(synthetic(3, 3, 6, seed))
        found, _ = timed(task)
        exhaustive = cheapest_of_all(task)
        assert abs(found.objective - exhaustive) <= 1e-9 * exhaustive, (seed, found.objective, exhaustive)
    print(f"optimum equals the exhaustive search over {18**3} campaigns, seeds {SEEDS}")


def check_large(task: Task, found: Campaign) -> None:
    assert found.proved
    assert found.gap == 0.0, found.gap
    again = counted_again(task, found)
    assert abs(again - found.objective) <= 1e-6 * again, (again, found.objective)
    used = sum(
        float(task.constraints[0].vectors[c.error][0, 0])
        * (m.largest_run_to_run + m.in_run + m.storage + c.points.residual + c.half_width)
        for c, m in zip(found.choices, task.models, strict=True)
    )
    assert used <= task.constraints[0].limit * (1 + 1e-9), (used, task.constraints[0].limit)


def sizes() -> Iterator[dict[str, int]]:
    """The large problem, and one of its sizes at a time made smaller or larger."""
    grown = {"temperatures": (5, 10, 15), "errors": (2, 3, 4, 5), "repeats": (10, 20, 80, 160)}
    yield LARGE
    for name, values in grown.items():
        yield from (LARGE | {name: value} for value in values)


def main() -> None:
    check_against_exhaustive_search()
    print("temperatures  errors  repeats   rows  seconds (median, longest of 3 seeds)")
    for size in sizes():
        seconds = []
        for seed in SEEDS[:3]:
            task = task_of(synthetic(**size, seed=seed))
            found, taken = timed(task)
            check_large(task, found)
            seconds.append(taken)
        rows = sum(len(group.cost) for group in task.problem.groups)
        figures = f"{sorted(seconds)[1]:7.2f} {max(seconds):7.2f}"
        print(f"{size['temperatures']:12d}  {size['errors']:6d}  {size['repeats']:7d}  {rows:5d}  {figures}")
        if size == LARGE:
            assert max(seconds) <= LARGEST_SECONDS, f"{max(seconds):.1f} s > {LARGEST_SECONDS} s"


if __name__ == "__main__":
    main()

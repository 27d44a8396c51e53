"""What must feel instant: loading a spec from a cold start, effects at 100 000 instants, a generation.

Each asserts its answer first. The least of several runs is judged: it is the work, the rest is what else the
machine was doing.

    OMP_NUM_THREADS=1 python benchmarks/bench_start.py
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the random conditions are the tests' own

from planner.catalog import effects
from planner.solvers.genetic import GeneticSettings, minimise
from tests.effects.conditions import random_conditions

SPEC = Path(__file__).parents[1] / "requirements_specs" / "small_uav.yaml"
COLD = f"""
import time; t = time.perf_counter()
from pathlib import Path; from planner.spec.load import load_spec
print(load_spec(Path({str(SPEC)!r})).spec.name, time.perf_counter() - t, sep="|")
"""
INSTANTS = 100_000
LOAD_S, EFFECT_S, GENERATION_S = 1.0, 0.5, 1e-3  # measured 0.25, 0.02, 0.00015


def least(work: Callable[[], float], runs: int = 3) -> float:
    return min(work() for _ in range(runs))


def seconds(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def loading() -> float:
    """Seconds of loading in a process of its own; SciPy or DEAP at the top of a module would show."""
    name, took = subprocess.check_output([sys.executable, "-c", COLD], text=True).split("|")
    assert name == "small UAV, one minute without aiding"
    return float(took)


def slowest_effect() -> tuple[float, str]:
    """Of all effects and sensors, at 100 000 instants."""
    conditions = random_conditions(np.random.default_rng(5), INSTANTS)
    found = []
    for effect in effects().values():
        for sensor in effect.sensors:
            assert effect.regressors(sensor, conditions).shape[:2] == (INSTANTS, 3)
            took = least(lambda e=effect, s=sensor: seconds(lambda: e.regressors(s, conditions)))
            found.append((took, f"{sensor}.{effect.name}"))
    return max(found)


def generation() -> float:
    """Seconds of a generation of the genetic algorithm on a linear function of twelve genes."""
    weight = np.random.default_rng(12).random(12)
    settings = GeneticSettings(generations=300, patience=300)
    begin = time.perf_counter()
    found = minimise(
        lambda g: np.abs(g @ weight - 1), np.zeros(12), np.ones(12), settings, np.random.default_rng(1)
    )
    took = (time.perf_counter() - begin) / settings.generations
    assert found.value < 1e-3
    return took


def main() -> None:
    load_s, (effect_s, name), generation_s = least(loading), slowest_effect(), least(generation)
    print(f"load {SPEC.name} from a cold start: {load_s:.2f} s")
    print(f"{INSTANTS} instants of the slowest effect, {name}: {effect_s * 1e3:.1f} ms")
    print(f"a generation of a linear function: {generation_s * 1e3:.3f} ms")
    assert load_s < LOAD_S
    assert effect_s < EFFECT_S
    assert generation_s < GENERATION_S


if __name__ == "__main__":
    main()

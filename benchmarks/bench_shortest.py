"""The search for the shortest campaign, as ratios: to the program's own imports, and to one nonlinear flight.

Every plan is first held to keep its promise by exact figures, and no campaign one step from it is shorter and
keeps it too.

OMP_NUM_THREADS=1 python benchmarks/bench_shortest.py
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from planner.information.choose import campaign_found
from planner.information.model_of import flight_of
from planner.information.neighbours import Neighbours
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.load import load_spec
from planner.verify.flights import flight_model, instants_of

SPECS = Path(__file__).parents[1] / "requirements_specs"
NAMES = ("close_the_loop", "helicopter", "high_g", "small_uav", "tactical_leg")


def seconds(do: Callable[[], object], times: int = 3) -> float:
    """The least of several."""
    found = []
    for _ in range(times):
        begin = time.perf_counter()
        do()
        found.append(time.perf_counter() - begin)
    return min(found)


def main() -> None:
    """A line a spec."""
    imports = seconds(lambda: subprocess.run([sys.executable, "-c", "import planner.pipelines.planning"]))
    for name in NAMES:
        loaded = load_spec(SPECS / f"{name}.yaml")
        trajectory = trajectory_of(loaded.spec.trajectory, loaded.folder)
        flight = flight_of(loaded.spec, trajectory)
        found = campaign_found(flight)
        limits = np.array([wanted.limit.si for wanted in loaded.spec.requirement])
        assert np.all(np.array(found.foreseen.largest) <= limits * (1 + 1e-6))
        near = Neighbours(found.offers).of(found.counts)
        shorter = near[found.offers.cost(near) < found.cost - 1e-6]
        assert not len(shorter) or found.judge.loads(shorter, [*found.judge.promise.families]).min() > 0.99
        search = seconds(partial(campaign_found, flight))
        instants = instants_of(trajectory, loaded.spec.requirement)
        one = flight_model(trajectory, [("gyro", "bias"), ("accelerometer", "bias")], instants)
        columns = one.linear.position.shape[2]
        flown = seconds(partial(one.navigate, np.zeros((1, columns))))
        print(
            f"{name}: {found.cost / 3600:.2f} h, {found.judge.asked} campaigns; search {search:.2f} s, "
            f"{search / imports:.2f} × imports, {search / flown:.2f} × one nonlinear flight"
        )


if __name__ == "__main__":
    main()

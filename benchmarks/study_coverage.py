"""How often 95 % intervals hold the truth: 600 campaigns of plain NumPy and of the simulator, all channels.

Prints the share for every kind of coefficient; asserts 95 % ± 2 over all of them.

OMP_NUM_THREADS=1 python benchmarks/study_coverage.py [campaigns]
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the campaigns are the tests' own

from planner.calibrate.fit_to_calibration import coefficients_of
from planner.protocols import SENSORS
from planner.simulate.campaign import Settings, prepared, simulate
from tests.calibrate import world
from tests.calibrate.truths import QUIET_RUNS, WorldTruth, any_spec, fitted
from tests.simulate.benches import campaign_of

LAYOUT = world.Layout(
    temperatures=(0.0, 20.0, 40.0),
    static_repeats=4,
    later=(),
    ramps=False,
    rate_repeats=3,
    rate_temperatures=(0.0, 20.0, 40.0),
    centrifuge=False,
)
Hit = tuple[str, bool]


def main() -> None:
    """Print every study."""
    campaigns = int(sys.argv[1]) if len(sys.argv) > 1 else 600
    for name, hits in (
        ("plain NumPy, run-to-run", plain(campaigns, world.Noise())),
        ("plain NumPy, no run-to-run", plain(campaigns, QUIET_RUNS)),
        ("simulator, run-to-run and in-run", simulated(campaigns, True)),
        ("simulator, no run-to-run", simulated(campaigns, False)),
    ):
        report(name, campaigns, hits)


def report(name: str, campaigns: int, hits: Iterator[Hit]) -> None:
    """Print the shares of one study and assert their mean."""
    shares: dict[str, list[bool]] = defaultdict(list)
    for key, hit in hits:
        shares[key].append(hit)
    print(f"{name}: {campaigns} campaigns")
    for key, found in sorted(shares.items()):
        print(f"  {key:40} {np.mean(found):7.2%}  of {len(found)}")
    assert 0.93 <= np.mean([np.mean(found) for found in shares.values()]) <= 0.97


def plain(campaigns: int, noise: world.Noise) -> Iterator[Hit]:
    """Units of tests/calibrate/world.py."""
    spec = any_spec()
    for seed in range(campaigns):
        table = world.campaign(seed, layout=LAYOUT, noise=noise)
        for sensor in SENSORS:
            truth = WorldTruth(seed, sensor)
            for channel in range(3):
                for c in coefficients_of(fitted(table, sensor, channel, spec), spec):
                    yield _key(c.error, c.temperature_degc), c.low <= truth.of(c) <= c.high


def simulated(campaigns: int, runs: bool) -> Iterator[Hit]:
    """Units of planner/simulate, three power-ons a test and temperature."""
    spec, plan = campaign_of(3, 3, "close_the_loop.yaml")
    unit, settings = prepared(spec), Settings(run_to_run=runs, in_run=runs, storage=False)
    for seed in range(campaigns):
        table, truth = simulate(plan, unit, seed, settings=settings)
        for sensor in SENSORS:
            for channel in range(3):
                for c in coefficients_of(fitted(table, sensor, channel, spec, spec.effects), spec):
                    degc = 20.0 if c.temperature_degc is None else c.temperature_degc
                    yield (
                        _key(c.error, c.temperature_degc),
                        c.low <= truth.at(c.error, c.term, degc) <= c.high,
                    )


def _key(error: str, degc: float | None) -> str:
    return error if degc is None else f"{error} at {round(degc / 20.0) * 20} degC"


if __name__ == "__main__":
    main()

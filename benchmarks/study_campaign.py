"""Does a campaign tell what its model promises? Simulated campaigns of every shipped spec, calibrated.

For every error, pooled: the sigma that the campaign's information promises over the one that the estimates
show (asked: 0.98 … 1.02), and how often the 95 % interval holds the truth (95 ± 1 %, exact binomial interval
beside it). For every coefficient: misses against chance, the smallest p over the family (asked: > 0.001).

OMP_NUM_THREADS=1 python benchmarks/study_campaign.py [campaigns a spec] [workers]
"""

from __future__ import annotations

import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from scipy.stats import beta, binomtest

sys.path.insert(0, str(Path(__file__).parents[1]))  # the campaigns are the tests' own

from planner.calibrate.fit_to_calibration import coefficients_of
from planner.campaign.design import Design, design
from planner.campaign.model import campaign
from planner.campaign.power_ons import of_design, of_table
from planner.campaign.triad import fit_triad
from planner.nouns.choices import Campaign, TestVisits
from planner.plan.by_hand import even_points
from planner.plan.schedule_to_steps import steps
from planner.protocols import SENSORS
from planner.simulate.campaign import prepared, simulate
from planner.simulate.settings import settings_of
from planner.spec.load import load_spec
from planner.spec.model import Noise, Spec
from tests.specs import SHIPPED

SPECS = ("close_the_loop", "helicopter", "high_g", "recalibration", "small_uav", "tactical_leg")
TEMPERATURES, REPEATS = 3, 4
Row = tuple[str, str, float, float, bool]  # error, coefficient, estimate − truth, promised sigma, covered


def noisy(name: str) -> Spec:
    """The spec, with a data sheet's noise where it has none: records without noise are no records."""
    spec = load_spec(SHIPPED / f"{name}.yaml").spec
    if spec.unit.noise.gyro is not None:
        return spec
    noise = Noise.model_validate({"gyro": "0.1 deg/sqrt(h)", "accelerometer": "0.05 m/s/sqrt(h)"})
    return spec.model_copy(update={"unit": spec.unit.model_copy(update={"noise": noise})})


def laid_out(spec: Spec) -> Design:
    """Every test at three temperatures of the range (or in the room) with four repeats."""
    points = even_points(*spec.plan.temperatures.range, TEMPERATURES)
    visits = []
    for name, test in spec.tests.items():
        room = spec.benches[test.bench].chamber is None or test.temperatures == "room"
        at = (spec.plan.temperatures.room,) if room else points
        visits.append(TestVisits(name, at, (REPEATS * (TEMPERATURES if room else 1),) * len(at)))
    return design(steps(spec, Campaign(tuple(visits), (), 0.0, 0.0, False)), spec)


def one(name: str, seeds: range) -> list[Row]:
    """Some campaigns of a spec."""
    spec = noisy(name)
    plan = laid_out(spec)
    unit, settings = prepared(spec), settings_of(spec)
    promised = {k: c.sigma() for k, c in campaign(spec, of_design(plan, spec)).channels.items()}
    rows: list[Row] = []
    for seed in seeds:
        table, truth = simulate(plan, unit, seed, settings=settings)
        for sensor in SENSORS:
            readings = table.gyro if sensor == "gyro" else table.acc
            assert readings is not None
            for fit in fit_triad(sensor, readings, of_table(table), spec, spec.effects):
                sigmas = promised[sensor, fit.model.channel]
                for c, sigma in zip(coefficients_of(fit, spec), sigmas, strict=True):
                    degc = 20.0 if c.temperature_degc is None else c.temperature_degc
                    true = truth.at(c.error, c.term, degc)
                    key = f"{name} {c.error} {c.channel} {c.term} {degc:.0f}"
                    rows.append((c.error, key, c.value - true, float(sigma), bool(c.low <= true <= c.high)))
    return rows


def main() -> None:
    """Print every error, and assert what is asked."""
    campaigns = int(sys.argv[1]) if len(sys.argv) > 1 else 840
    workers = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    start = time.perf_counter()
    jobs = [(n, range(a, min(a + 20, campaigns))) for a in range(0, campaigns, 20) for n in SPECS]
    rows: list[Row] = []
    done = 0
    try:
        for part in Parallel(workers, return_as="generator")(delayed(one)(*job) for job in jobs):
            rows += part
            done += 1
            print(f"{done} of {len(jobs)} jobs, {time.perf_counter() - start:.0f} s", file=sys.stderr)
    except KeyboardInterrupt:
        print("stopped: what was done so far")
    made = sum(len(job[1]) for job in jobs[:done])
    print(f"{made} of {campaigns * len(SPECS)} campaigns, {time.perf_counter() - start:.0f} s")
    report(rows)


def report(rows: list[Row]) -> None:
    """Pooled per error; then the worst coefficient."""
    by_error: dict[str, list[Row]] = defaultdict(list)
    by_key: dict[str, list[bool]] = defaultdict(list)
    for row in rows:
        by_error[row[0]].append(row)
        by_key[row[1]].append(row[4])
    print(f"{'error':42} {'n':>7} {'promised/observed':>18} {'within 95 %':>12} {'exact interval':>18}")
    for error, mine in sorted(by_error.items()):
        print(line(error, mine))
    worst = {k: binomtest(len(v) - sum(v), len(v), 0.05).pvalue for k, v in by_key.items()}
    least = min(worst, key=lambda k: worst[k])
    family = 1.0 - (1.0 - worst[least]) ** len(worst)
    print(
        f"{len(worst)} coefficients; least likely: {least}, p {worst[least]:.2g}, of the family {family:.3g}"
    )


def line(error: str, mine: list[Row]) -> str:
    """One error: ratio of root mean squares in units of each promise, and the share within."""
    z = np.array([row[2] / row[3] for row in mine if np.isfinite(row[3])])
    hits, n = sum(row[4] for row in mine), len(mine)
    low, high = beta.ppf([0.025, 0.975], [hits, hits + 1], [n - hits + 1, max(n - hits, 1)])
    ratio = 1.0 / float(np.sqrt(np.mean(z**2)))
    return f"{error:42} {n:7d} {ratio:18.3f} {hits / n:12.2%} {low:9.2%} … {high:6.2%}"


if __name__ == "__main__":
    main()

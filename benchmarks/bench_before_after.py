"""Behind a diagnosis: before and after on runs held out, cost in flight, what to measure next, the page.

Asserts the answer first (the residual comes down to the noise on runs not seen), then prints the seconds for
campaigns of more and more records, six channels each.

python benchmarks/bench_before_after.py
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # the campaigns are the tests' own

from planner.diagnose.diagnosis_to_navigation import navigation_costs
from planner.diagnose.diagnosis_to_next_measurement import next_measurements
from planner.diagnose.diagnosis_to_residual import residual_changes, unit_fits
from planner.nouns.diagnosis import Diagnosis, Rival
from planner.plan.spec_to_trajectory import trajectory_of
from planner.report.page import html
from planner.report.subjects.diagnosis import diagnosis_report
from planner.spec.load import load_spec
from tests.calibrate.world import Hidden, Layout, campaign
from tests.diagnose.found import found_effect, unit_diagnosis

SPEC = load_spec(Path(__file__).parents[1] / "requirements_specs" / "small_uav.yaml").spec
REPEATS = (2, 20, 150)  # about 600, 4 000 and 29 000 records


def main() -> None:
    """Print a line for each size."""
    print(
        f"{'records':>8} {'fits':>7} {'held out':>9} {'flight':>7} {'next':>6} {'page':>6} {'in all':>7}  s"
    )
    flight = trajectory_of(SPEC.trajectory, Path())
    for repeats in REPEATS:
        layout = Layout(static_repeats=repeats, rate_repeats=repeats, later=(30.0,))
        table = campaign(1, [Hidden("g_sensitivity", "gyro_x", 0.003)], layout)
        found = unit_diagnosis(table, SPEC, [found_effect("g_sensitivity", "gyro_x", 1e-5, 1e-6)])
        rivals = tuple(replace(e, rivals=(Rival("g_squared_sensitivity", 2.0),)) for e in found.effects)
        found = replace(found, effects=rivals)
        moments = [time.perf_counter()]
        fits = unit_fits(table, SPEC, found)
        moments.append(time.perf_counter())
        residual = residual_changes(fits)
        moments.append(time.perf_counter())
        navigation = navigation_costs(found.effects, fits, SPEC, flight)
        moments.append(time.perf_counter())
        wanted = next_measurements(found.effects, fits, SPEC)
        moments.append(time.perf_counter())
        whole = Diagnosis(found, residual, navigation, wanted, "0", "bench", "", "", "", 1)
        page = html(diagnosis_report(whole, table))
        moments.append(time.perf_counter())
        (change,) = [c for c in residual if c.channel == "gyro_x"]
        assert change.held_out
        assert change.sigma_before > 1.5 > 1.2 > change.sigma_after
        assert "Missing: g sensitivity" in page
        parts = [b - a for a, b in pairwise(moments)]
        print(f"{len(table):8d} " + " ".join(f"{p:7.2f}" for p in (*parts, sum(parts))))


if __name__ == "__main__":
    main()

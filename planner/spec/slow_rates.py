"""Rates at which no sane number of repeats tells a gyro's scale factor (K 2.5.2, table 2.17).

One record at the rate ω tells it with a spread δ; the bias that moves between the record and the rest before
it weighs σ_b/ω, the scale factor's own spread s whatever the rate is:

    δ² = s² + (σ_b² + N²/T)/ω²,   n = (q δ/d)²

K's gyro of 500 deg/s has δ = .107 % above 10 deg/s and 13.2 % at 0.005 deg/s, and with d = .1 % at 99 % K's
repeats from 8 to 116 600; its rows at .05, .1 and 1 deg/s follow no one d. Below 1/100 of the range K finds
the scale factor out of reach.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.spec.budget import INPUT_REACH, ErrorBudget
from planner.spec.model import Spec, Test
from planner.spec.motions import motions_of
from planner.units import from_si

CONFIDENCE_99 = 2.576  # two-sided quantile of the normal law
ENOUGH = 1e-3  # relative half-width that K's repeats are for


def spread_of_one(rate: float, own: float, bias: float) -> float:
    """δ: one sigma of a scale factor by one record, relative; own: s, bias: σ_b in the unit of the rate."""
    return float(np.hypot(own, bias / abs(rate)))


def repeats_for(spread: float) -> int:
    """n by K's eq. 27 at 99 %."""
    return int(np.ceil((CONFIDENCE_99 * spread / ENOUGH) ** 2))


def slow_rates(spec: Spec) -> Iterator[tuple[str, str]]:
    """Test and a sentence, for every test whose slowest rate is below what tells a scale factor."""
    told = {name: test for name, test in spec.tests.items() if _tells_scale(test)}
    asked = {name: _rates(spec, name) for name, test in told.items() if test.bench in spec.benches}
    fastest = max((rate for rates in asked.values() for rate in rates), default=0.0)
    for name, rates in asked.items():
        slow = [rate for rate in rates if rate < INPUT_REACH * fastest]
        if slow:
            yield name, _said(spec, name, min(slow), fastest)


def _tells_scale(test: Test) -> bool:
    return any(error.startswith("gyro.scale_factor") for error in test.calibrates)


def _rates(spec: Spec, name: str) -> list[float]:
    """deg/s of a test's motions that turn, without sign."""
    test = spec.tests[name]
    motions = motions_of(test.bench, spec.benches[test.bench], test)
    every = (abs(value) for m in motions for axis, value in (m or {}).items() if axis.startswith("rate"))
    return [rate for rate in every if rate > 0.0]


def _said(spec: Spec, name: str, rate: float, fastest: float) -> str:
    gyro, record = spec.unit.gyro, spec.tests[name].record
    bias, scale = gyro.get("bias"), gyro.get("scale_factor")
    drift = 0.0 if bias is None else np.hypot(bias.in_run_sigma, bias.run_to_run_largest)
    white = spec.unit.white_of_records("gyro") / np.sqrt(record) if record > 0.0 else 0.0
    moves = float(from_si(float(np.hypot(drift, white)), "deg/s"))
    spread = spread_of_one(rate, _own(scale, float(np.radians(rate))), moves)
    return (
        f"at {rate:g} deg/s, 1/{fastest / rate:.0f} of the {fastest:g} deg/s that the tests "
        f"reach, one record tells the scale factor to {100.0 * spread:.2g} % (the bias moves by "
        f"{moves:.2g} deg/s); to know it to {100.0 * ENOUGH:g} % at 99 % takes {repeats_for(spread)} "
        f"repeats; take rates of {INPUT_REACH * fastest:g} deg/s or more"
    )


def _own(scale: ErrorBudget | None, rate: float) -> float:
    """s at a rate, rad/s: by the spec's table over the input, or the same at all rates."""
    if scale is None or not scale.run_to_run_over_input:
        return 0.0 if scale is None else scale.run_to_run_largest
    return float(np.interp(rate, *np.transpose(scale.run_to_run_over_input)))

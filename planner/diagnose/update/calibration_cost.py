"""What one repeat of a bench test tells of an effect's coefficient, and which test tells it at least cost.

    s = sqrt(max_k [(XᵀV⁻¹X + Λ⁻²)⁻¹]_kk),   X = [J, G]

J the declared model on the records of one power-on, G the effect's columns, V white noise of a record and the
part that grows with the input, Λ what the declared coefficients are known to besides (their budgets' spread;
the bias not at all, it is this power-on's). n repeats then give the mean to t·s/√n, as every other error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from planner import catalog
from planner.campaign.channel_model import channel_model
from planner.diagnose.update.bench_runs import BenchRun, run_of_test, run_of_trial
from planner.diagnose.weighed_fit import linear_jacobian
from planner.measurement import evaluate, sensed
from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.spec.model import Spec

TRIALS = (6, 12, 30)  # records of a test that is made up
UNKNOWN = 1e6  # spread, SI, of what nothing is known of
KNOWN_RATIO = 1e-3  # of a declared coefficient without a budget


@dataclass(frozen=True)
class RecordNoise:
    """Noise of one record of `duration` s, SI; rate: share of the input by which it strays besides."""

    white: float
    duration: float
    rate: float = 0.0


@dataclass(frozen=True)
class Target:
    """What is to be calibrated: an effect on some channels (0, 1, 2) of a sensor, of a size in SI."""

    sensor: Sensor
    effect: str
    axes: tuple[int, ...]
    size: float
    nonlinear: Mapping[str, float] = field(default_factory=dict)

    @property
    def error(self) -> str:
        """`gyro.warm_up`."""
        return f"{self.sensor}.{self.effect}"


@dataclass(frozen=True)
class CalibratingTest:
    """A test that can show an effect: its name ("" for a new one) and what one repeat tells, SI."""

    run: BenchRun
    spread: float
    repeats: int


def calibrating_test(
    spec: Spec,
    target: Target,
    noise: RecordNoise,
) -> CalibratingTest | None:
    """The spec's test that tells the coefficient best per hour, or a new one; None when no test can.

    A test can when one repeat tells less scatter than the effect's size, and the most repeats half of it.
    """
    found = _best(spec, [run_of_test(spec, name) for name in spec.tests], target, noise)
    if found is not None:
        return found
    trials = [
        run_of_trial(spec, bench, target.error, count)
        for bench, b in spec.benches.items()
        if target.error in getattr(catalog.benches().get(b.kind or bench), "observes", ())
        for count in TRIALS
    ]
    return _best(spec, trials, target, noise)


def _best(spec: Spec, runs: list[BenchRun], target: Target, noise: RecordNoise) -> CalibratingTest | None:
    choice = spec.plan.repeats
    possible = []
    for run in runs:
        kind = catalog.benches().get(spec.benches[run.bench].kind or run.bench)
        if kind is None or target.error not in kind.observes:
            continue
        spread = repeat_spread(spec, run, target, noise)
        needed = (2.0 * 2.0 * spread / max(target.size, 1e-300)) ** 2  # t ≈ 2, half of the size
        if needed <= choice.most and spread < target.size:
            repeats = max(choice.least, int(np.ceil(needed)))
            possible.append((spread * np.sqrt(run.repeat_s), CalibratingTest(run, spread, repeats)))
    return min(possible, key=lambda p: p[0])[1] if possible else None


def repeat_spread(spec: Spec, run: BenchRun, target: Target, noise: RecordNoise) -> float:
    """s in SI, the largest over the channels' terms; near UNKNOWN when the run does not show one of them."""
    worst, run = 0.0, _where_it_shows(spec, run, target)
    full = catalog.effects()[target.effect].regressors(target.sensor, run.conditions, target.nonlinear)
    terms = catalog.effects()[target.effect].terms(target.sensor)
    for axis in target.axes:
        acts = [i for i, term in enumerate(terms) if axis in term.channels]
        if acts:
            worst = max(worst, _spread(spec, run, target, axis, full[:, axis, acts], noise))
    return worst


def _where_it_shows(spec: Spec, run: BenchRun, target: Target) -> BenchRun:
    """At that end of the range which lies further from the run's own temperature, for what changes with it.

    Per kelvin from 20 degC nothing shows at 20 degC; other power-ons tell what it is there.
    """
    effect, own = catalog.effects()[target.effect], run.conditions.temperature_degc
    if not catalog.changes_with_temperature(effect) or not len(own):
        return run
    end = max(spec.plan.temperatures.range, key=lambda degc: abs(degc - own[0]))
    return replace(run, conditions=replace(run.conditions, temperature_degc=np.full_like(own, end)))


def _spread(spec: Spec, run: BenchRun, target: Target, axis: int, G: Array, noise: RecordNoise) -> float:
    known, sensor = catalog.effects(), target.sensor
    declared = tuple(e for e in spec.effects if known[e].temperature_of is None)  # one power-on, one point
    model = channel_model(sensor, axis, run.conditions, declared)
    theta = model.start()
    J = linear_jacobian(model, theta, evaluate(model, theta))
    curve = target.effect not in catalog.origins("effects")
    spreads = [_known(spec, sensor, c.effect, curve) for c in model.columns() if not c.parameter]
    u = sensed(sensor, run.conditions)[:, axis]
    sigma = np.sqrt(noise.white**2 * noise.duration / run.duration + (noise.rate * u) ** 2)
    prior = np.diag(1.0 / np.array([*spreads, *[UNKNOWN] * G.shape[1]]))
    X = np.concatenate([np.column_stack([J, G]) / sigma[:, None], prior])
    scale = np.linalg.norm(X, axis=0)
    _, s, vt = np.linalg.svd(X / scale, full_matrices=False)
    variance = np.sum((vt.T / s) ** 2, axis=1) / scale**2
    return float(np.sqrt(variance[-G.shape[1] :].max()))


def _known(spec: Spec, sensor: Sensor, effect: str, curve: bool) -> float:
    """To what a declared coefficient is known from other tests, SI.

    curve: a measured curve is zero where a test may have no record, as turns have none at rest: what is
        common to all its records is told by what other tests say of the bias, to a power-on's own draw
    """
    budget = getattr(spec.unit, sensor).get(effect)
    if not catalog.effects()[effect].needs:
        told = curve and any(f"{sensor}.{effect}" in t.calibrates for t in spec.tests.values())
        drawn = np.hypot(budget.run_to_run_largest, budget.in_run_sigma) if told and budget else 0.0
        return float(drawn) or UNKNOWN  # otherwise a constant is this power-on's own
    if budget is None:
        return KNOWN_RATIO
    return float(max(budget.run_to_run_largest, budget.in_run_sigma, budget.storage_sigma, 1e-9))

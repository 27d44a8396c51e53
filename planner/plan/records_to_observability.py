"""Records of all tests → can they tell the errors that the tests calibrate? Refused where they cannot.

One repeat of every test stands for the campaign: more repeats and temperatures of the same records narrow
what they determine, and determine nothing else. A channel's records y = Σ_e x_e θ_e + noise of all tests,
with the covariance of `planner.plan.records_to_spread` and a power-on of its own for each test, give every
calibrated coefficient the standard error σ = √(XᵀU⁻¹X)⁻¹. After the most repeats allowed it is σ/√n: an
error that is then known no better than it is without a calibration is not calibrated, whatever a test says.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner import catalog
from planner.errors import InputError
from planner.plan.by_hand import fixed_repeats
from planner.plan.channel_terms import ChannelTerm, channels, columns_of, terms_on
from planner.plan.confidence import quantile
from planner.plan.excitation import excitation
from planner.plan.motions_to_records import RepeatRecords, repeat_records
from planner.plan.records_to_spread import DEGENERATE, covariances, drifts_of, root_of
from planner.protocols import SENSORS, Sensor
from planner.records import Array, ErrorModel
from planner.sensor import ErrorName
from planner.solvers.least_squares import factors
from planner.spec.model import Given, Spec

BASIC = ("misalignment", "scale_factor", "bias")
PARTNER = 0.1  # share of the strongest coefficient in a combination from which one takes part in it


@dataclass(frozen=True)
class Untold:
    """Terms of one error on one channel that the records do not tell, and from which errors they do not."""

    error: str
    term: str
    channel: int
    partners: tuple[str, ...]


def refuse_the_undetermined(spec: Spec, models: Sequence[ErrorModel]) -> None:
    """Raises InputError when the records of the tests cannot tell an error that they calibrate.

    The message names the error, its tests, what it is mixed up with and what is missing. Published
    coefficients stand for all axes together, so no axis can be asked for: nothing is refused.
    """
    if isinstance(spec.sensitivities, Given):
        return
    made = _records(spec)
    calibrated = [m for m in models if m.calibrated and _tests(spec, m.name) <= set(made)]
    found = [u for sensor, c in channels() for u in _untold(spec, calibrated, models, made, sensor, c)]
    errors = {u.error for u in found}
    faults = [_fault(spec, made, [u for u in found if u.error == error]) for error in _told_once(found)]
    faults += [
        _alone(m)
        for m in calibrated
        if m.name not in errors and m.within and not np.isfinite(min(m.within.values()))
    ]
    if faults:
        raise InputError("\n".join(faults))


def _told_once(found: Sequence[Untold]) -> list[str]:
    """Errors to name: of two that are mixed up with each other only the one beside bias and scale factor."""
    partners: dict[str, set[str]] = {}
    for u in found:
        partners.setdefault(u.error, set()).update(u.partners)
    named: list[str] = []
    for error in sorted(partners, key=lambda e: BASIC.index(_effect(e)) if _effect(e) in BASIC else -1):
        if not partners[error] or not partners[error] & set(named):
            named.append(error)
    return named


def _effect(error: str) -> str:
    return ErrorName(error).effect


def mixed_up_in_calibration(spec: Spec, models: Sequence[ErrorModel]) -> list[str]:
    """Remarks on declared effects that nobody calibrates, where a fit cannot tell them from what is."""
    if isinstance(spec.sensitivities, Given):
        return []
    made = _records(spec)
    calibrated = [m for m in models if m.calibrated and _tests(spec, m.name) <= set(made)]
    idle = _declared_without(spec, calibrated)
    mixed: dict[str, set[str]] = {}
    for sensor, channel in channels():
        for u in _untold(spec, [*calibrated, *idle], models, made, sensor, channel):
            if u.error not in {m.name for m in idle}:
                for partner in {m.name for m in idle} & set(u.partners):
                    mixed.setdefault(partner, set()).add(u.error)
    return [
        f"effects: {partner} is declared, but no test calibrates it: the records cannot tell it from "
        f"{', '.join(sorted(errors))}, so a fit finds neither; calibrate it, or take it out of effects"
        for partner, errors in mixed.items()
    ]


def _declared_without(spec: Spec, calibrated: Sequence[ErrorModel]) -> list[ErrorModel]:
    known, served = catalog.effects(), {m.name for m in calibrated}
    return [
        ErrorModel(name, known[effect].units[sensor], 0.0, ((float("nan"), 0.0),), 0.0, 0.0, 0.0, False)
        for effect in spec.effects
        for sensor in SENSORS
        if sensor in known[effect].sensors and (name := f"{sensor}.{effect}") not in served
    ]


def _records(spec: Spec) -> dict[str, RepeatRecords]:
    tests = [name for name, test in spec.tests.items() if test.calibrates]
    return {name: records for name in tests if (records := repeat_records(spec, name)) is not None}


def _tests(spec: Spec, error: str) -> set[str]:
    return {name for name, test in spec.tests.items() if error in test.calibrates}


# ---------------------------------------------------------------- one channel


def _untold(
    spec: Spec,
    asked: Sequence[ErrorModel],
    models: Sequence[ErrorModel],
    made: dict[str, RepeatRecords],
    sensor: Sensor,
    channel: int,
) -> Iterator[Untold]:
    terms = terms_on(sensor, channel, asked)
    if not terms:
        return
    X = _whitened(spec, terms, models, made, sensor, channel)
    found = factors(X, DEGENERATE)
    sigma = np.where(found.undetermined(), np.inf, np.sqrt(np.sum(found.to_coefficients**2, axis=1)))
    by_name = {m.name: m for m in asked}
    for i, term in enumerate(terms):
        model = by_name[term.error]
        if model.calibrated and not _worth(spec, model, float(sigma[i])):
            alone = np.linalg.norm(X[:, i])
            shows = alone > 0 and _worth(spec, model, float(1.0 / alone))
            yield Untold(term.error, term.term, channel, _partners(X, terms, i) if shows else ())


def _whitened(
    spec: Spec,
    terms: Sequence[ChannelTerm],
    models: Sequence[ErrorModel],
    made: dict[str, RepeatRecords],
    sensor: Sensor,
    channel: int,
) -> Array:
    """(rows of all tests, k) columns of the terms, their noise made white test by test."""
    every = terms_on(sensor, channel, models)
    by_name = {m.name: m for m in models}
    run = np.array([by_name[t.error].largest_run_to_run for t in every])
    drift = drifts_of([by_name[t.error] for t in every])
    blocks = []
    for records in made.values():
        around = columns_of(sensor, channel, every, records.conditions)
        _, U = covariances(records, around, run, drift, spec.unit.white(sensor))
        X = columns_of(sensor, channel, terms, records.conditions)
        blocks.append(np.linalg.solve(root_of(U, around, run), X))
    return np.concatenate(blocks)


def _worth(spec: Spec, model: ErrorModel, sigma: float) -> bool:
    """Whether the most repeats make an estimate of this sigma a repeat better than none."""
    if not np.isfinite(sigma):
        return False
    if model.whole_variation == 0:
        return True
    most = [_most(spec, name) for name in _tests(spec, model.name)]
    q = quantile(spec.plan.confidence, "normal", np.array([2]))[0]
    return bool(q * sigma / np.sqrt(max(most)) <= model.whole_variation)


def _most(spec: Spec, test: str) -> int:
    fixed = fixed_repeats(spec, test)
    return spec.plan.repeats.most if fixed is None else int(np.max(fixed))


def _partners(X: Array, terms: Sequence[ChannelTerm], i: int) -> tuple[str, ...]:
    """The other errors of the combination that hides term i most."""
    size = np.linalg.norm(X, axis=0)
    _, s, vt = np.linalg.svd(X / np.where(size > 0, size, 1.0), full_matrices=True)
    s = np.concatenate([s, np.zeros(len(vt) - len(s))])
    hidden = vt[int(np.argmax(np.abs(vt[:, i]) / np.maximum(s, 1e-15 * s[0])))]
    strong = np.flatnonzero(np.abs(hidden) > PARTNER * np.abs(hidden).max()).tolist()
    return tuple(dict.fromkeys(terms[j].error for j in strong if j != i))


# ---------------------------------------------------------------- in words


def _fault(spec: Spec, made: dict[str, RepeatRecords], found: Sequence[Untold]) -> str:
    """`tests.rates: its records cannot tell gyro.scale_factor_nonlinearity x, y, z from …`."""
    error, first = found[0].error, found[0]
    tests = [name for name in made if error in spec.tests[name].calibrates]
    partners = tuple(dict.fromkeys(p for u in found for p in u.partners if p != error))
    terms = ", ".join(dict.fromkeys(u.term for u in found))
    what = f"cannot tell {error} ({terms})" + (f" from {_and(partners)}" if partners else " at all")
    seen, advice = excitation(error, first.channel, first.term, [made[name].conditions for name in tests])
    return f"tests.{_and(tests)}: the records {what}: {seen}; {advice}"


def _alone(model: ErrorModel) -> str:
    tests = [name for name, sigma in model.within.items() if not np.isfinite(sigma)]
    return (
        f"tests.{_and(tests)}: no test alone tells {model.name} from what else it calibrates, only all "
        "together do; put the motions that tell them apart into one test"
    )


def _and(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else names[0]

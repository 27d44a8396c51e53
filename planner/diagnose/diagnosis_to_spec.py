"""What was found → the spec with it declared: few edits of the text, each with its reason.

A found effect goes into `effects` and gets a budget: `systematic`, its size before calibration, and
`run_to_run`, what one repeat of the test that calibrates it tells. One that no campaign of the tests on offer
tells, or that hides there what they calibrate, has its budget alone, which stays whole in what is promised:
declared it would let nothing be planned. Effects of the bench alone and temperature tables of errors that
have a budget need no budget of their own. Spreads that the data contradict are replaced.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from planner import __version__, catalog
from planner.diagnose.update.calibration_cost import CalibratingTest, RecordNoise, Target, calibrating_test
from planner.diagnose.update.left_in_budget import widened
from planner.diagnose.update.ramp_test import ramp_test
from planner.diagnose.update.shape_in_plan import at_its_parameters, not_declared, parameter_notes
from planner.diagnose.update.sizes_in_spec import written
from planner.diagnose.update.spreads_in_spec import contradicted, corrected
from planner.errors import InputError
from planner.measurement import AXES
from planner.nouns.diagnosis import LEAST_P, Diagnosis, FoundEffect, NavigationCost
from planner.nouns.sensor import ErrorName, short
from planner.plan.observable_campaign import not_to_declare
from planner.protocols import Effect
from planner.spec.budget import ErrorBudget
from planner.spec.load import LoadedSpec, spec_from_bytes
from planner.spec.model import Given, Spec
from planner.spec.text_edit import SpecText

_WHITE = {"gyro": 2e-5, "accelerometer": 1e-3}  # rad/s, m/s²: a record's noise when the diagnosis has none
_RECORD_S = 60.0  # the record that _WHITE is of


@dataclass(frozen=True)
class SpecUpdate:
    """The new text, what was changed and why, and what a person should know."""

    text: str
    changes: tuple[str, ...]
    notes: tuple[str, ...]
    diff: str


def updated_spec(text: str, loaded: LoadedSpec, diagnosis: Diagnosis) -> SpecUpdate:
    """The spec's text with what the diagnosis found.

    Raises InputError for a diagnosis of another spec, one that found nothing to change, and one whose
    effects the spec declares already.
    """
    _refuse(loaded, diagnosis)
    planned = not isinstance(loaded.spec.sensitivities, Given)
    # what goes with days no plan tells, however large it is
    left_out = frozenset(e.effect for e in diagnosis.found.effects if planned and _goes_with_days(e.effect))
    while True:
        made, fresh = _made(text, loaded, diagnosis, left_out)
        wrong = _wrongly_declared(made.text, loaded.path, fresh) if fresh else fresh
        if not wrong:
            return made
        left_out |= wrong


def _wrongly_declared(text: str, path: Path, fresh: frozenset[str]) -> frozenset[str]:
    """Of the effects that a new spec declares besides those that it must not; none where it has faults."""
    try:
        return not_to_declare(spec_from_bytes(text.encode(), path).spec, fresh)
    except InputError:
        return frozenset()  # whoever reads the new spec says where, of the file that it is to be


def _made(
    text: str, loaded: LoadedSpec, diagnosis: Diagnosis, left_out: frozenset[str]
) -> tuple[SpecUpdate, frozenset[str]]:
    """The new text and the names that it declares besides; left_out: such as it must not."""
    edits, changes, notes = SpecText(text), [], []
    spec = loaded.spec
    harm = [c for c in diagnosis.navigation if not c.helps]
    curves = [] if harm else _curves(spec, diagnosis)
    lacking = not_declared(_merged(diagnosis.found.effects), spec)
    fresh = [] if harm else [at_its_parameters(e) for e in lacking]
    fresh += curves
    ways = [(e, _way(spec, e, diagnosis)) for e in fresh]
    names = list(dict.fromkeys(e.effect for e in fresh if e.effect not in left_out))
    if names:
        edits.append(("effects",), names)
        changes.append(f"effects: declared {', '.join(names)}")
    for effect, way in ways:
        edits.settle()  # the next one finds the tests that are there now
        said, noted = _enter(edits, spec, effect, None if effect.effect in left_out else way)
        changes += said
        notes += noted
    edits.settle()
    wrong = contradicted(diagnosis.found)
    for assumption in wrong:
        changes += corrected(edits, spec, assumption)
    done = {(a.error, a.part) for a in wrong}
    changes += widened(edits, spec, diagnosis, done, {c for e in curves for c in e.channels})
    if harm:
        notes.append(_no_help(harm[0]))
    if not changes:
        if harm:
            raise InputError(_no_help(harm[0]) + "; nothing to update")
        known = sorted({e.effect for e in diagnosis.found.effects})
        why = f"; it declares {', '.join(known)} already" if known else ""
        raise InputError(
            f"the diagnosis ({diagnosis.found.verdict}) found nothing that the spec lacks{why}: "
            "nothing to update"
        )
    notes += _unnamed(diagnosis, curves)
    edits.head([*_digest(loaded, diagnosis), *(f"  {change}" for change in changes)])
    new = edits.edited()
    update = SpecUpdate(new, tuple(changes), tuple(notes), _diff(text, new, loaded.path.name))
    return update, frozenset(names)


def _no_help(cost: NavigationCost) -> str:
    return (
        f"compensation of what was found does not help in flight ({cost.error}: "
        f"{written(max(cost.before, cost.as_calibrated), cost.unit)} without it, "
        f"{written(cost.after, cost.unit)} with it): it is not declared"
    )


def _refuse(loaded: LoadedSpec, diagnosis: Diagnosis) -> None:
    if diagnosis.spec_sha256 != loaded.sha256:
        raise InputError(
            f"the diagnosis is of another spec: {diagnosis.spec_name!r} with sha256 "
            f"{diagnosis.spec_sha256[:12]}…, but {loaded.path} has {loaded.sha256[:12]}…; "
            f"give the spec that was diagnosed, or run 'planner diagnose' with this one"
        )


def _digest(loaded: LoadedSpec, diagnosis: Diagnosis) -> list[str]:
    return [
        f"Updated by planner {__version__} from {loaded.path.name} (sha256 {loaded.sha256})",
        f"after the diagnosis of unit {diagnosis.found.unit} from {diagnosis.source or 'its data'} "
        f"(sha256 {diagnosis.data_sha256[:16]}…):",
    ]


def _curves(spec: Spec, diagnosis: Diagnosis) -> list[FoundEffect]:
    """Measured curves that the spec lacks and that one of its tests, or a new one, can calibrate."""
    if isinstance(spec.sensitivities, Given):
        return []
    found = [u.curve for u in diagnosis.found.unknown if u.curve is not None]
    return [c for c in found if c.effect not in spec.effects and _test(spec, c, _size(c)[0], diagnosis)]


def _unnamed(diagnosis: Diagnosis, curves: Sequence[FoundEffect]) -> list[str]:
    declared = {e.effect for e in curves}
    return [
        f"{', '.join(u.channels)}: something that varies with {u.varies_with} is still unnamed; "
        + (
            f"its measured curve is declared, {u.curve.effect}"
            if u.curve is not None and u.curve.effect in declared
            else "what is left of it is in the budget, and no coefficient"
        )
        for u in diagnosis.found.unknown
    ]


def _diff(old: str, new: str, name: str) -> str:
    lines = difflib.unified_diff(
        old.splitlines(), new.splitlines(), f"{name} (old)", f"{name} (new)", lineterm="", n=1
    )
    return "\n".join(lines)


def _merged(effects: Sequence[FoundEffect]) -> list[FoundEffect]:
    """One entry per sensor and effect: the same effect on several channels is one error of the spec."""
    found: dict[tuple[str, str], FoundEffect] = {}
    for e in effects:
        key = (e.sensor, e.effect)
        before = found.get(key)
        found[key] = (
            e
            if before is None
            else FoundEffect(
                e.effect,
                e.sensor,
                (*before.channels, *e.channels),
                (*before.terms, *e.terms),
                max(before.p_value, e.p_value),
                min(before.strength, e.strength),
                (*before.rivals, *e.rivals),
                before.below_bench_uncertainty or e.below_bench_uncertainty,
                before.nonlinear,
            )
        )
    return list(found.values())


# ---------------------------------------------------------------- a found effect


@dataclass(frozen=True)
class _Way:
    """How an effect is calibrated: by a test, or by one on ramps; neither: by whatever the records tell."""

    test: CalibratingTest | None = None
    ramp: Mapping[str, str] | None = None


def _way(spec: Spec, found: FoundEffect, diagnosis: Diagnosis) -> _Way:
    effect = catalog.effects()[found.effect]
    if effect.bench_only or effect.temperature_of is not None or isinstance(spec.sensitivities, Given):
        return _Way()
    test = _test(spec, found, _size(found)[0], diagnosis)
    if test is not None:
        return _Way(test=test)
    error = f"{found.sensor}.{found.effect}"
    ramp = ramp_test(spec, found.effect, error, _noise(found, diagnosis).duration)
    return _Way(ramp=ramp)


def _enter(edits: SpecText, spec: Spec, found: FoundEffect, way: _Way | None) -> tuple[list[str], list[str]]:
    """Budget and test of one found effect: what was changed, what to know; no way: it is not declared."""
    error = f"{found.sensor}.{found.effect}"
    notes = _doubts(found)
    effect = catalog.effects()[found.effect]
    if way is None and (effect.bench_only or effect.temperature_of is not None):
        return [], [*notes, f"{error} is not declared: it hides what the tests calibrate"]
    if effect.bench_only:
        return [], [*notes, f"{error} is an effect of the bench: it is fitted, and has no budget in flight"]
    if effect.temperature_of is not None:
        return [], notes + _table_needed(spec, found, effect.temperature_of)
    if found.effect in getattr(spec.unit, found.sensor):
        return [], [*notes, f"{error} has a budget already: it is kept"]
    size, left = _size(found)
    given = isinstance(spec.sensitivities, Given)
    unit = effect.units[found.sensor]
    parts = {"systematic": written(left if given else size, unit)}
    if way is not None and way.test and spec.planned_by == "published":
        # K's half-width t s / √n asks for the scatter of one repeat; planning by information knows it itself
        parts["run_to_run"] = written(way.test.spread, unit)
    budget = "{" + ", ".join(f"{key}: {value}" for key, value in parts.items()) + "}"
    edits.enter(("unit", found.sensor), found.effect, budget, _reason(found))
    changes = [f"unit.{error}: {budget}"]
    if given:
        why = "the spec gives published coefficients, which have none for it"
        serve = "the coefficients of the diagnosis serve, and `systematic` is what is left"
        return changes, [*notes, f"{error}: {why}; {serve}"]
    if way is None:
        return changes, [*notes, _budgeted_alone(error, effect)]
    if way.ramp is not None:
        return [*changes, _added(edits, spec, error, way.ramp)], notes
    if way.test is not None:
        return [*changes, _calibrated(edits, spec, error, way.test)], notes
    return changes, [*notes, f"{error}: no test is made for it; the records of the others tell it"]


def _goes_with_days(name: str) -> bool:
    return "day" in catalog.effects()[name].needs


def _budgeted_alone(error: str, effect: Effect) -> str:
    why = (
        "no plan spreads records over the days that it needs"
        if _goes_with_days(effect.name)
        else "no test of these benches tells it and lets the rest be told beside it"
    )
    return (
        f"{error}: {why}; it is not declared, and its budget stays whole in what is promised. A spec that "
        f"declares {ErrorName(error).effect} calibrates it from the data that were diagnosed"
    )


def _doubts(found: FoundEffect) -> list[str]:
    error = f"{found.sensor}.{found.effect}"
    notes = []
    if found.below_bench_uncertainty:
        notes.append(f"{error} is below the bench's own uncertainty: it may be the bench")
    if found.rivals:
        known, names = catalog.effects(), list(dict.fromkeys(r.effect for r in found.rivals))
        others = ", ".join(name if name in known else f"anything over {name}" for name in names)
        would = "; next_measurement says what would" if any(name in known for name in names) else ""
        notes.append(f"{error} cannot be told from {others} by these data{would}")
    return notes + parameter_notes(found)


def _table_needed(spec: Spec, found: FoundEffect, plain: str) -> list[str]:
    budget: ErrorBudget | None = getattr(spec.unit, found.sensor).get(plain)
    if budget is not None and budget.temperature_residual is not None:
        return []
    return [
        f"give unit.{found.sensor}.{plain} a temperature_residual, so that temperature points can be planned"
    ]


def _size(found: FoundEffect) -> tuple[float, float]:
    """The largest end of the coefficients' intervals, and the largest half-width, SI."""
    linear = [t for t in found.terms if not t.parameter]
    ends = [abs(x) for t in linear for x in (t.low, t.high, t.value) if math.isfinite(x)]
    half = [(t.high - t.low) / 2.0 for t in linear if math.isfinite(t.high - t.low)]
    size = max(ends, default=0.0)
    return size, max(half, default=size)


def _test(spec: Spec, found: FoundEffect, size: float, diagnosis: Diagnosis) -> CalibratingTest | None:
    axes = tuple(sorted({AXES.index(c[-1]) for c in found.channels}))
    target = Target(found.sensor, found.effect, axes, size, found.nonlinear)
    return calibrating_test(spec, target, _noise(found, diagnosis))


def _noise(found: FoundEffect, diagnosis: Diagnosis) -> RecordNoise:
    """The noise of one record of these channels, the worst of them, once the effect is in the model, SI."""
    mine = {short(c) for c in found.channels}
    seen = [r for r in diagnosis.residual if short(r.channel) in mine and math.isfinite(r.white)]
    if not seen:
        return RecordNoise(_WHITE[found.sensor], _RECORD_S)
    worst = max(seen, key=lambda r: r.white)
    duration = worst.record if math.isfinite(worst.record) and worst.record > 0 else _RECORD_S
    return RecordNoise(worst.white, duration, max(0.0, worst.stray))


def _reason(found: FoundEffect) -> str:
    channels = ", ".join(map(short, found.channels))
    p = f"= {found.p_value:.2g}" if found.p_value >= LEAST_P else f"< {LEAST_P:g}"
    return f"found by diagnosis on {channels}, p {p}"


def _calibrated(edits: SpecText, spec: Spec, error: str, test: CalibratingTest) -> str:
    """Let the test calibrate the error, or add the test."""
    run = test.run
    if run.test:
        if edits.node(("tests", run.test, "calibrates")) is not None:
            edits.append(("tests", run.test, "calibrates"), [error])
        else:
            edits.enter(("tests", run.test), "calibrates", f"[{error}]")
        return f"tests.{run.test}: calibrates {error}"
    others = [t for t in spec.tests.values() if t.bench == run.bench]
    parts = {
        "bench": run.bench,
        "calibrates": f"[{error}]",
        "motions": str(len(run.duration)),
        "power_on": f"{max((t.power_on for t in others), default=0.0):g} s",
        "record": f"{float(run.duration.max()):g} s",
        "cool_down": f"{max((t.cool_down for t in others), default=0.0):g} s",
    }
    if spec.benches[run.bench].chamber is None:
        parts["temperatures"] = "room"
    return _added(edits, spec, error, parts)


def _added(edits: SpecText, spec: Spec, error: str, parts: Mapping[str, str]) -> str:
    """A new test; one that was added for the other sensor serves where all but the error is the same."""
    first = f"show_{ErrorName(error).effect.partition('_over_')[0]}"  # a curve's nodes are no part of it
    names = [first, *(f"{first}_{k}" for k in range(len(spec.tests) + 1, len(spec.tests) + 9))]
    for name in names:
        there = edits.written(("tests", name))
        if there is None:
            edits.enter(("tests",), name, "{" + ", ".join(f"{k}: {v}" for k, v in parts.items()) + "}")
            return f"tests.{name}: a new test on {parts['bench']} that calibrates {error}"
        if name not in spec.tests and {**there, "calibrates": parts["calibrates"]} == parts:
            edits.append(("tests", name, "calibrates"), [error])
            return f"tests.{name}: calibrates {error} too"
    raise InputError(f"tests: {first} and eight names after it are taken; give one of these tests another")

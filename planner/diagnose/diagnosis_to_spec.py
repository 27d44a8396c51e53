"""What was found → the spec with it declared: few edits of the text, each with its reason.

A found effect goes into `effects` and gets a budget: `systematic`, its size before calibration (or what is
left of it, where no test of the plan can calibrate it and the diagnosis' own coefficients must serve), and
`run_to_run`, what one repeat of the test that calibrates it tells. Effects of the bench alone and temperature
tables of errors that have a budget need no budget of their own. Spreads that the data contradict are
replaced.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from planner import __version__, catalog
from planner.diagnose.calibration_cost import CalibratingTest, RecordNoise, Target, calibrating_test
from planner.diagnose.left_in_budget import widened
from planner.diagnose.ramp_test import ramp_test
from planner.diagnose.shape_in_plan import at_its_parameters, not_declared, parameter_notes
from planner.errors import InputError
from planner.measurement import AXES
from planner.nouns.diagnosed_spreads import NOISE, WHITE_OF_1_S, Assumption
from planner.nouns.diagnosis import LEAST_P, Diagnosis, FoundEffect, NavigationCost
from planner.nouns.sensor import ErrorName
from planner.spec.budget import ErrorBudget, InRun, RunToRun
from planner.spec.load import LoadedSpec
from planner.spec.model import Given, Spec
from planner.spec.text_edit import SpecText
from planner.units import Quantity, from_si

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
    edits, changes, notes = SpecText(text), [], []
    spec = loaded.spec
    harm = [c for c in diagnosis.navigation if not c.helps]
    curves = [] if harm else _curves(spec, diagnosis)
    lacking = not_declared(_merged(diagnosis.found.effects), spec)
    fresh = [] if harm else [at_its_parameters(e) for e in lacking]
    fresh += curves
    names = list(dict.fromkeys(e.effect for e in fresh))
    if names:
        edits.append(("effects",), names)
        changes.append(f"effects: declared {', '.join(names)}")
    for effect in fresh:
        said, noted = _enter(edits, spec, effect, diagnosis)
        changes += said
        notes += noted
    wrong = _contradicted(diagnosis.found.assumptions)
    for assumption in wrong:
        changes += _corrected(edits, spec, assumption)
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
    return SpecUpdate(new, tuple(changes), tuple(notes), _diff(text, new, loaded.path.name))


def _no_help(cost: NavigationCost) -> str:
    return (
        f"compensation of what was found does not help in flight ({cost.error}: "
        f"{_written(max(cost.before, cost.as_calibrated), cost.unit)} without it, "
        f"{_written(cost.after, cost.unit)} with it): it is not declared"
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


def _enter(
    edits: SpecText, spec: Spec, found: FoundEffect, diagnosis: Diagnosis
) -> tuple[list[str], list[str]]:
    """Budget and test of one found effect: what was changed, what to know."""
    error = f"{found.sensor}.{found.effect}"
    notes = _doubts(found)
    effect = catalog.effects()[found.effect]
    if effect.bench_only:
        return [], [*notes, f"{error} is an effect of the bench: it is fitted, and has no budget in flight"]
    if effect.temperature_of is not None:
        return [], notes + _table_needed(spec, found, effect.temperature_of)
    if found.effect in getattr(spec.unit, found.sensor):
        return [], [*notes, f"{error} has a budget already: it is kept"]
    size, left = _size(found)
    test = None if isinstance(spec.sensitivities, Given) else _test(spec, found, size, diagnosis)
    ramp = None if test else ramp_test(spec, found.effect, error, _noise(found, diagnosis).duration)
    unit = effect.units[found.sensor]
    parts = {"systematic": _written(size if test or ramp else left, unit)}
    if test and spec.planned_by == "published":
        # K's half-width t s / √n asks for the scatter of one repeat; planning by information knows it itself
        parts["run_to_run"] = _written(test.spread, unit)
    budget = "{" + ", ".join(f"{key}: {value}" for key, value in parts.items()) + "}"
    edits.enter(("unit", found.sensor), found.effect, budget, _reason(found))
    changes = [f"unit.{error}: {budget}"]
    if ramp is not None:
        return [*changes, _added(edits, spec, error, ramp)], notes
    if test is None:
        why = (
            "the spec gives published coefficients, which have none for it"
            if isinstance(spec.sensitivities, Given)
            else "no test of these benches can show it in a soaked power-on"
        )
        notes.append(
            f"{error}: {why}; the coefficients of the diagnosis serve, and `systematic` is what is left"
        )
        return changes, notes
    return [*changes, _calibrated(edits, spec, error, test)], notes


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
    mine = {_short(c) for c in found.channels}
    seen = [r for r in diagnosis.residual if _short(r.channel) in mine and math.isfinite(r.white)]
    if not seen:
        return RecordNoise(_WHITE[found.sensor], _RECORD_S)
    worst = max(seen, key=lambda r: r.white)
    duration = worst.record if math.isfinite(worst.record) and worst.record > 0 else _RECORD_S
    return RecordNoise(worst.white, duration, max(0.0, worst.stray))


def _short(channel: str) -> str:
    return channel.replace("accelerometer_", "acc_")


def _reason(found: FoundEffect) -> str:
    channels = ", ".join(map(_short, found.channels))
    p = f"= {found.p_value:.2g}" if found.p_value >= LEAST_P else f"< {LEAST_P:g}"
    return f"found by diagnosis on {channels}, p {p}"


def _calibrated(edits: SpecText, spec: Spec, error: str, test: CalibratingTest) -> str:
    """Let the test calibrate the error, or add the test."""
    run = test.run
    if run.test:
        if spec.tests[run.test].calibrates:
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
    """A new test."""
    name = f"show_{ErrorName(error).effect.partition('_over_')[0]}"  # a curve's nodes are no part of it
    name += "" if name not in spec.tests else f"_{len(spec.tests) + 1}"
    edits.enter(("tests",), name, "{" + ", ".join(f"{k}: {v}" for k, v in parts.items()) + "}")
    return f"tests.{name}: a new test on {parts['bench']} that calibrates {error}"


# ---------------------------------------------------------------- spreads that the data contradict


def _contradicted(assumptions: Sequence[Assumption]) -> list[Assumption]:
    """Per error and part the largest measured spread, where the intervals exclude what was assumed.

    Upwards when one channel's interval lies above; downwards only when every channel's lies below, and never
    within a power-on: what drifts for longer than that counts as run-to-run there, so the figure is a least.
    """
    groups: dict[tuple[str, str], list[Assumption]] = {}
    for a in assumptions:
        if a.assumed is not None and all(map(math.isfinite, (a.measured, a.low, a.high))):
            groups.setdefault((a.error, a.part), []).append(a)
    found = []
    for (_, part), several in groups.items():
        assumed = several[0].assumed or 0.0
        above = any(a.low > assumed for a in several)
        below = all(a.high < assumed for a in several) and part not in ("in_run", WHITE_OF_1_S)
        largest = max(several, key=lambda a: a.measured)
        if (above or below) and largest.measured > 0.0 and largest.low > 0.0:
            found.append(largest)
    return found


def _corrected(edits: SpecText, spec: Spec, a: Assumption) -> list[str]:
    """Replace one spread; a table over temperature or points keeps its shape and is scaled."""
    sensor, effect = ErrorName(a.error).parts
    if a.part == WHITE_OF_1_S:
        return _louder(edits, sensor, a)
    budget: ErrorBudget | None = getattr(spec.unit, sensor).get(effect)
    value = getattr(budget, a.part, None)
    path: tuple[str, ...] = ("unit", sensor, effect, a.part)
    if value is None and a.part == "in_run" and budget is not None:
        edits.enter(path[:-1], a.part, _written(a.measured, a.unit))
        return [f"unit.{a.error}.{a.part}: measured {_written(a.measured, a.unit)}, where none was budgeted"]
    if value is None or a.assumed is None:
        return []
    if isinstance(value, InRun | RunToRun):
        path, value = (*path, "value"), value.value
    interval = f"{_plain(a.low, a.unit)} … {_written(a.high, a.unit)}"
    said = f"unit.{a.error}.{a.part}: measured {_written(a.measured, a.unit)} ({interval}, 95 %)"
    if isinstance(value, Quantity):
        if abs(value.si - a.assumed) > 1e-6 * a.assumed:
            return []
        told = _written(a.measured, _unit_in(value))
        if a.part == "run_to_run" and path[-1] == a.part and spec.planned_by == "information":
            told = f"{{value: {told}, power_ons: {_power_ons(a)}}}"
        edits.replace(path, told)
        return [f"{said} instead of {value.text}"]
    if not isinstance(value, Mapping) or a.assumed <= 0.0:
        return []
    node = edits.node(path)
    for key, (_, entry) in zip(value, node.value, strict=True):
        scaled = value[key].si * a.measured / a.assumed
        edits.replace((*path, _key(node, entry)), _written(scaled, _unit_in(value[key])))
    return [
        f"{said} against {_written(a.assumed, a.unit)}: the table is scaled by {a.measured / a.assumed:.3g}"
    ]


def _louder(edits: SpecText, sensor: str, a: Assumption) -> list[str]:
    """The noise density of a sensor as its noisiest channel has it: never less than the spec says."""
    size, _, unit = _written(a.measured, a.unit).partition(" ")
    told = f"{size} {unit}/sqrt(Hz)"
    edits.replace(("unit", NOISE, sensor), told)
    said = f"{_plain(a.low, a.unit)} … {_plain(a.high, a.unit)}, 95 %; {_plain(a.assumed or 0.0, a.unit)}"
    return [f"unit.{NOISE}.{sensor}: measured {told} ({said} was budgeted)"]


def _power_ons(a: Assumption) -> int:
    """As many power-ons as would tell a spread as well as these data do."""
    return max(2, round(min(a.freedom, 1e4)) + 1)


def _unit_in(quantity: Quantity) -> str:
    """The unit in which the spec writes a size: it keeps it."""
    return re.sub(r"^[-+0-9.eE_ ]*", "", quantity.text).strip() or "1"


def _key(mapping: object, entry: object) -> str:
    return next(str(k.value) for k, v in mapping.value if v is entry)  # type: ignore[attr-defined]  # a node of PyYAML, handed through as it is


def _plain(si: float, unit: str) -> str:
    """Three significant digits."""
    shown = "%" if unit in ("", "1") else unit
    return f"{from_si(si, shown):.3g}"


def _written(si: float, unit: str) -> str:
    """A size with its unit, rounded up to three digits, so that nothing is understated."""
    shown = "%" if unit in ("", "1") else unit
    value = from_si(si, shown)
    if value > 0.0:
        step = 10.0 ** (math.floor(math.log10(value)) - 2)
        value = math.ceil(value / step - 1e-9) * step
    return f"{value:.3g} {shown}"

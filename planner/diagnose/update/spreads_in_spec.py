"""Spreads and noise that the data contradict, replaced where a spec has them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from planner.diagnose.update.sizes_in_spec import plain, written
from planner.nouns.diagnosed_spreads import BUDGETED, NOISE, WHITE_OF_1_S, Assumption
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.sensor import ErrorName
from planner.spec.budget import ErrorBudget, InRun, RunToRun
from planner.spec.model import Spec
from planner.spec.text_edit import SpecText
from planner.units import Quantity


def contradicted(found: UnitDiagnosis) -> list[Assumption]:
    """Per error and part the largest measured spread, where the data exclude what was assumed.

    Upwards where the diagnosis says that the budget is exceeded: of a dozen spreads one lies outside its 95 %
    interval by chance, and 0.009 deg/s that three power-ons seemed to tell of 0.002 made a plan of 100 m one
    of 417 m. Downwards only when every channel's interval lies below, and never within a power-on: what
    drifts for longer than that counts as run-to-run there, so the figure is a least.
    """
    exceeded = {(b.error, b.part) for b in found.budget_exceeded}
    groups: dict[tuple[str, str], list[Assumption]] = {}
    for a in found.assumptions:
        if a.assumed is not None and all(map(math.isfinite, (a.measured, a.low, a.high))):
            groups.setdefault((a.error, a.part), []).append(a)
    wrong = []
    for (error, part), several in groups.items():
        assumed = several[0].assumed or 0.0
        above = (error, part) in exceeded if part in BUDGETED else any(a.low > assumed for a in several)
        below = all(a.high < assumed for a in several) and part not in ("in_run", WHITE_OF_1_S)
        largest = max(several, key=lambda a: a.measured)
        if (above or below) and largest.measured > 0.0 and largest.low > 0.0:
            wrong.append(largest)
    return wrong


def corrected(edits: SpecText, spec: Spec, a: Assumption) -> list[str]:
    """Replace one spread; a table over temperature or points keeps its shape and is scaled."""
    sensor, effect = ErrorName(a.error).parts
    if a.part == WHITE_OF_1_S:
        return _louder(edits, sensor, a)
    budget: ErrorBudget | None = getattr(spec.unit, sensor).get(effect)
    value = getattr(budget, a.part, None)
    path: tuple[str, ...] = ("unit", sensor, effect, a.part)
    if value is None and a.part == "in_run" and budget is not None:
        edits.enter(path[:-1], a.part, written(a.measured, a.unit))
        return [f"unit.{a.error}.{a.part}: measured {written(a.measured, a.unit)}, where none was budgeted"]
    if value is None or a.assumed is None:
        return []
    if isinstance(value, InRun | RunToRun):
        path, value = (*path, "value"), value.value
    interval = f"{plain(a.low, a.unit)} … {written(a.high, a.unit)}"
    said = f"unit.{a.error}.{a.part}: measured {written(a.measured, a.unit)} ({interval}, 95 %)"
    if isinstance(value, Quantity):
        if abs(value.si - a.assumed) > 1e-6 * a.assumed:
            return []
        told = written(a.measured, _unit_in(value))
        if a.part == "run_to_run" and path[-1] == a.part and spec.planned_by == "information":
            told = f"{{value: {told}, power_ons: {_power_ons(a)}}}"
        edits.replace(path, told)
        return [f"{said} instead of {value.text}"]
    if not isinstance(value, Mapping) or a.assumed <= 0.0:
        return []
    node = edits.node(path)
    for key, (_, entry) in zip(value, node.value, strict=True):
        scaled = value[key].si * a.measured / a.assumed
        edits.replace((*path, _key(node, entry)), written(scaled, _unit_in(value[key])))
    return [
        f"{said} against {written(a.assumed, a.unit)}: the table is scaled by {a.measured / a.assumed:.3g}"
    ]


def _louder(edits: SpecText, sensor: str, a: Assumption) -> list[str]:
    """The noise density of a sensor as its noisiest channel has it: never less than the spec says."""
    size, _, unit = written(a.measured, a.unit).partition(" ")
    told = f"{size} {unit}/sqrt(Hz)"
    edits.replace(("unit", NOISE, sensor), told)
    said = f"{plain(a.low, a.unit)} … {plain(a.high, a.unit)}, 95 %; {plain(a.assumed or 0.0, a.unit)}"
    return [f"unit.{NOISE}.{sensor}: measured {told} ({said} was budgeted)"]


def _power_ons(a: Assumption) -> int:
    """As many power-ons as would tell a spread as well as these data do."""
    return max(2, round(min(a.freedom, 1e4)) + 1)


def _unit_in(quantity: Quantity) -> str:
    """The unit in which the spec writes a size: it keeps it."""
    return re.sub(r"^[-+0-9.eE_ ]*", "", quantity.text).strip() or "1"


def _key(mapping: object, entry: object) -> str:
    return next(str(k.value) for k, v in mapping.value if v is entry)  # type: ignore[attr-defined]  # a node of PyYAML, handed through as it is

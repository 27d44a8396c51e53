"""Rules for `requirement.temperature`: some flights start somewhere, and the rule asks where."""

from __future__ import annotations

from planner import catalog
from planner.spec.flight_temperature import TemperatureShares
from planner.spec.review import Review
from planner.spec.rules_unit import once
from planner.spec.yaml12 import Path


def flight_temperatures(sheet: Review) -> None:
    """All rules for the temperatures of all requirements."""
    for index, requirement in sheet.requirements():
        path = (*sheet.item(("requirement",), index), "temperature")
        if (
            requirement.rule == "worst_case"
            and sheet.readable((*path[:-1], "rule"))
            and sheet.written(path) is not None
        ):
            sheet.warn(
                "P231",
                path,
                "worst_case adds the largest errors wherever they are, so this says nothing; "
                "write 'rule: {percentile: 95 %}' or rss, or leave temperature out",
                key=True,
            )
        if isinstance(requirement.temperature, TemperatureShares):
            _shares(sheet, path, requirement.temperature)
    _flown_at_one(sheet)


def _flown_at_one(sheet: Review) -> None:
    """Sums of moduli take effects that change with temperature by their own equation along the trajectory.

    A promise counts them wherever a flight starts; what follows the rate of temperature adds nothing to a
    flight that is soaked.
    """
    if not any(r.rule == "worst_case" for _, r in sheet.requirements()):
        return
    known = catalog.effects()
    for index, name in enumerate(sheet.spec.effects):
        effect = known.get(name)
        if effect is not None and not effect.bench_only and catalog.changes_with_temperature(effect):
            sheet.warn(
                "P333",
                ("effects", index),
                f"worst_case adds '{name}' as it is at the trajectory's own temperature (20 degC unless it "
                "says otherwise), where it may be nothing; percentile or rss count it wherever flights start",
            )


def _shares(sheet: Review, path: Path, asked: TemperatureShares) -> None:
    where = (*path, "distribution")
    once(sheet, where)
    if not any(asked.distribution.values()):
        sheet.fault("P232", where, "all weights are zero, so no flight starts anywhere; give one that is not")
    if not sheet.whole("plan", "temperatures"):
        return
    low, high = sheet.spec.plan.temperatures.range
    outside = [f"{t:g}" for t in sorted(asked.distribution) if not low <= t <= high]
    if outside:
        sheet.warn(
            "P233",
            where,
            f"{', '.join(outside)} degC: outside plan.temperatures.range, {low:g} to {high:g} degC, "
            "where no budget describes the errors; they count as flights at its end",
        )

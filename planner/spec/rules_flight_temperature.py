"""Rules for `requirement.temperature`: some flights start somewhere, and the rule asks where."""

from __future__ import annotations

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
            "where the error's curve is only continued",
        )

"""Rules for `plan.method`: keys of the published method say nothing to a plan made by information."""

from __future__ import annotations

from planner.spec.review import Review
from planner.spec.yaml12 import Path


def method(sheet: Review) -> None:
    """Remarks on what the file says and nobody asks; a fault for an estimator that there is not yet."""
    if sheet.spec.plan.temperature_estimator == "smooth":
        sheet.fault(
            ("plan", "temperature_estimator"),
            "smooth is not built yet: calibrate fits tables with straight lines, so no plan can rest on it; "
            "write lines, or leave it out",
        )
    if sheet.spec.planned_by == "published" or not _sure(sheet):
        return
    step = sheet.spec.plan.temperatures.step
    idle: dict[Path, str] = {
        ("plan", "quantile"): "counts with sigmas and no quantile",
        ("plan", "temperatures", "candidates"): f"chooses among temperatures every {step:g} K (step)",
        ("plan", "temperatures", "interpolate"): "reads no residual from a number of points",
    }
    for path, why in idle.items():
        if sheet.written(path) is not None:
            sheet.warn(
                path,
                f"says nothing here: method information {why}; remove it, or plan by 'method: published'",
                key=True,
            )


def _sure(sheet: Review) -> bool:
    """Whether what decides about the method is readable."""
    return all(sheet.whole(*path) for path in (("requirement",), ("sensitivities",), ("plan", "method")))

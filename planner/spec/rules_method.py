"""Rules for `plan.method`: keys of the published method say nothing to a plan made by information."""

from __future__ import annotations

from planner.spec.review import Review
from planner.spec.yaml12 import Path


def method(sheet: Review) -> None:
    """Remarks on what the file says and nobody asks; a fault for an estimator that a plan cannot rest on."""
    if not sheet.method_sure:
        return
    _estimator(sheet)
    if sheet.spec.planned_by == "published":
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
                "P531",
                path,
                f"says nothing here: method information {why}; remove it, or plan by 'method: published'",
                key=True,
            )


def _estimator(sheet: Review) -> None:
    """`smooth` needs the method that knows curves by their second moments, and curves."""
    path: Path = ("plan", "temperature_estimator")
    if sheet.spec.plan.temperature_estimator == "lines":
        return
    if sheet.spec.planned_by == "published":
        why = "asked for" if sheet.spec.plan.method == "published" else "that of worst_case and of given ones"
        sheet.fault(
            "P532",
            path,
            f"smooth goes with method information: the published method ({why}) reads what straight lines "
            "leave from temperature_residual; write lines, or plan by information",
        )
    elif all(budget.temperature_residual is None for _, _, _, budget in sheet.budgets()):
        sheet.warn(
            "P533",
            path,
            "says nothing here: no error has a temperature_residual, and without one nothing says how "
            "smooth a table is; tables keep straight lines",
        )

"""Rules for `initial_alignment`: it says something, once, and its angles are small enough to be errors."""

from __future__ import annotations

from planner.spec.review import Review

COARSEST_RAD = 0.5235987755982988  # 30 deg: errors of attitude are small angles everywhere


def initial_alignment(sheet: Review) -> None:
    """All rules for `initial_alignment`."""
    asked = sheet.spec.initial_alignment
    if asked is None:
        return
    if sheet.written(("initial_alignment",)) == {}:
        sheet.fault(
            "P361",
            ("initial_alignment",),
            "is empty; give e.g. {roll_pitch: 0.05 deg, heading: 0.5 deg}, or remove it: it is perfect then",
            key=True,
        )
    for key in ("roll_pitch", "heading"):
        if getattr(asked, key) > COARSEST_RAD:
            sheet.fault(
                "P362", ("initial_alignment", key), "is more than 30 deg; nobody could navigate from there"
            )
    if asked.self_aligned and "roll_pitch" in asked.model_fields_set:
        sheet.fault(
            "P363",
            ("initial_alignment", "roll_pitch"),
            "self_aligned levels roll and pitch by the accelerometers, whose errors the unit's budgets give; "
            "leave roll_pitch out",
        )
    if sheet.published:
        sheet.warn(
            "P364",
            ("initial_alignment",),
            "flies in verify, but the published method (asked for, or that of worst_case and of given "
            "sensitivities) has no place for it in the budget; a percentile or rss counts it",
            key=True,
        )

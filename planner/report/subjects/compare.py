"""A comparison of plans: hours side by side, error against hours, what differs and why."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from planner.report.blocks import Items, Report, Table, Text, existing, section
from planner.report.charts.comparison import comparison_picture
from planner.report.comparison import Comparison, Difference
from planner.report.numbers import NOTHING, digits, display_unit, hours, in_unit, percent, plain, when
from planner.report.plan_facts import MICROSECONDS
from planner.units import unit_factor

_CENTIHOUR = 36 * MICROSECONDS  # hours are printed with two decimals


def comparison_report(c: Comparison) -> Report:
    """The plans beside each other, and every plan against the first."""
    shas = "the specs differ: " + ", ".join(h[:12] or "unknown" for h in c.spec_sha256)
    differences = (Items(tuple(_reasons(d)), f"{d.plan} against {c.plans[0]}:") for d in c.differences)
    return Report(
        kind="Comparison of plans",
        title=" / ".join(c.plans),
        answer=f"{' against '.join(map(_hours, c.time_us))} h" if c.differ else "The plans do not differ.",
        sections=existing(
            section("picture", "At a glance", comparison_picture(c), only="page"),
            section("specs", "The specs", Text(shas) if len(set(c.spec_sha256)) > 1 else None),
            section("hours", "Hours", _table("hours", c, _hour_rows(c))),
            section(
                "error", "Error against hours", _table("navigation error against hours", c, _error_rows(c))
            ),
            section("allowed", "Allowed sensor errors", _table("allowed sensor errors", c, _allowed_rows(c))),
            section("reasons", "What differs and why", *differences),
        ),
    )


def _table(caption: str, c: Comparison, rows: Sequence[tuple[str, ...]]) -> Table | None:
    return Table(caption, ("", *c.plans), tuple(rows)) if rows else None


def _reasons(difference: Difference) -> Iterator[str]:
    for reason, added in zip(difference.reasons, _rounded(difference), strict=True):
        yield f"{reason.what}: {reason.why}: {_signed_hours(added)} h"
    yield f"together {_signed_hours(difference.added_us)} h"


def _hour_rows(c: Comparison) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for title, group in (("bench", c.benches), ("test", c.tests), ("action", c.actions)):
        rows += [(_row_name(title, s.name), *map(_hours, s.time_us)) for s in group]
    rows.append(("powered", *map(_hours, c.power_on_us)))
    rows.append(("all", *map(_hours, c.time_us)))
    rows.append(("gap", *(NOTHING if g is None else plain(percent(g, 2)) for g in c.gap)))
    return rows


def _row_name(title: str, name: str) -> str:
    """`bench rate_table`, `action cool down`; what is of no test is installing, ramps, soaks."""
    if (title, name) == ("test", "none"):
        return "no test"
    return f"{title} {name.replace('_', ' ') if title == 'action' else name}"


def _error_rows(c: Comparison) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [("hours", *map(_hours, c.time_us))]
    for r in c.requirements:
        pairs = zip(r.achieved, r.limit, strict=True)
        rows.append(
            (
                f"{r.error} {when(r.at)}, {r.rule.replace('_', ' ')}, {r.unit}",
                *(_of_limit(a, limit) for a, limit in pairs),
            )
        )
    return rows


def _allowed_rows(c: Comparison) -> list[tuple[str, ...]]:
    rows = []
    for a in c.allowances:
        sizes = [None if value is None else value * unit_factor(a.unit)[0] for value in a.allowed]
        cells = (NOTHING if size is None else plain(digits(in_unit(size, a.unit))) for size in sizes)
        rows.append((f"{a.error}, {display_unit(a.unit)}", *cells))
    return rows


def _of_limit(achieved: float | None, limit: float | None) -> str:
    if achieved is None or limit is None:
        return NOTHING
    sign = "<=" if achieved <= limit * (1 + 1e-9) else ">"  # what a sum of ten terms may be off by
    return plain(f"{digits(achieved)} {sign} {digits(limit)}")


def _hours(time_us: int) -> str:
    return plain(hours(time_us / MICROSECONDS))


def _rounded(difference: Difference) -> list[int]:
    """The reasons in whole hundredths of an hour with the sum kept: sums are rounded, not terms."""
    total, before, found = 0, 0, []
    for reason in difference.reasons:
        total += reason.added_us
        after = round(total / _CENTIHOUR) * _CENTIHOUR
        found.append(after - before)
        before = after
    return found


def _signed_hours(time_us: int) -> str:
    return ("+" if time_us > 0 else "") + _hours(time_us)

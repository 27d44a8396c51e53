"""The nouns of a comparison of plans; times are whole microseconds so that reasons add up exactly."""

from __future__ import annotations

from dataclasses import dataclass

MICROSECONDS = 1_000_000  # in a second


@dataclass(frozen=True)
class Spent:
    """Microseconds of one heading in every plan, 0 where a plan has none."""

    name: str
    time_us: tuple[int, ...]


@dataclass(frozen=True)
class Reason:
    """One thing that differs between two plans, and the microseconds that it adds."""

    what: str
    why: str
    added_us: int


@dataclass(frozen=True)
class Difference:
    """One plan against the first: its reasons sum to `added_us` exactly."""

    plan: str
    added_us: int
    reasons: tuple[Reason, ...]


@dataclass(frozen=True)
class Reached:
    """One requirement of one plan: limit and what is achieved, in `unit`; None where the plan lacks it."""

    error: str
    at: str
    rule: str
    unit: str
    limit: tuple[float | None, ...]
    achieved: tuple[float | None, ...]


@dataclass(frozen=True)
class Allowed:
    """What every plan allows one sensor error, in `unit`; None where the plan lacks it."""

    error: str
    unit: str
    allowed: tuple[float | None, ...]


@dataclass(frozen=True)
class Comparison:
    """Two or more plans; tuples run over the plans in the order given, differences over all but the first."""

    plans: tuple[str, ...]
    spec_sha256: tuple[str, ...]
    time_us: tuple[int, ...]
    power_on_us: tuple[int, ...]
    gap: tuple[float | None, ...]
    benches: tuple[Spent, ...]
    tests: tuple[Spent, ...]
    actions: tuple[Spent, ...]
    requirements: tuple[Reached, ...]
    allowances: tuple[Allowed, ...]
    differences: tuple[Difference, ...]
    same_steps: bool

    @property
    def differ(self) -> bool:
        """Whether any plan does anything else, takes another time or reaches other figures than the first."""
        other_time = any(d.reasons or d.added_us for d in self.differences)
        pairs = [pair for r in self.requirements for pair in (r.limit, r.achieved)]
        return not self.same_steps or other_time or any(len(set(pair)) > 1 for pair in pairs)

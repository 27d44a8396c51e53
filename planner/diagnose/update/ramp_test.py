"""A test on ramps for an effect of the rate of temperature, which no soaked power-on shows (K 2.4.2)."""

from __future__ import annotations

from collections.abc import Mapping

from planner import catalog
from planner.protocols import Effect
from planner.spec.model import Bench, Chamber, Spec, Test

FASTEST_K_S = 2.0 / 60.0  # K's tables go to ±2 K/min
LEAD_S = 120.0
ROUND_K = 1.0  # to which temperatures are drawn in where the chamber has no room for the ramps


def ramp_test(spec: Spec, name: str, error: str, record_s: float) -> Mapping[str, str] | None:
    """Key -> text of a test that calibrates an error; None where no ramp shows it, or none is planned."""
    effect = catalog.effects()[name]
    known = [catalog.effects()[e] for e in (*spec.effects, name)]
    history = any(getattr(e, "history", False) for e in known)
    if "temperature_rate" not in effect.needs or history or spec.planned_by == "published":
        return None
    if "cool_down" in spec.plan.overlap:
        return None
    for bench_name, bench in spec.benches.items():
        found = _speed(bench)
        temperatures = () if found is None else _temperatures(spec, effect, found[0], found[1], record_s)
        if found is not None and temperatures:
            return _written(spec, bench_name, error, found[1], temperatures, record_s)
    return None


def _speed(bench: Bench) -> tuple[Chamber, float] | None:
    """The chamber and how fast it goes both ways, K/s; None for one that cannot, or does not say."""
    c = bench.chamber
    if c is None or c.heating is None or c.cooling is None:
        return None
    return c, min(FASTEST_K_S, c.heating, c.cooling)


def _temperatures(
    spec: Spec, effect: Effect, chamber: Chamber, speed: float, record_s: float
) -> tuple[float, ...]:
    """degC: the nodes of a table, of anything else the ends of the range, as far as the chamber has room."""
    room = speed * (LEAD_S + record_s / 2.0)
    low, high = chamber.range[0] + room + ROUND_K, chamber.range[1] - room - ROUND_K
    nodes = getattr(effect, "temperatures", spec.plan.temperatures.range)
    return tuple(sorted({round(min(max(t, low), high)) for t in nodes})) if low < high else ()


def _written(
    spec: Spec, bench: str, error: str, speed: float, temperatures: tuple[float, ...], record_s: float
) -> Mapping[str, str]:
    others: list[Test] = [t for t in spec.tests.values() if t.bench == bench]
    return {
        "bench": bench,
        "calibrates": f"[{error}]",
        "motions": "1",
        "power_on": f"{max((t.power_on for t in others), default=0.0):g} s",
        "record": f"{max(round(record_s), 1)} s",
        "cool_down": f"{max((t.cool_down for t in others), default=0.0):g} s",
        "temperature": f"{{ramp: {60.0 * speed:g} K/min, lead: {LEAD_S:g} s}}",
        "temperatures": "[" + ", ".join(f"{t:g} degC" for t in temperatures) + "]",
    }

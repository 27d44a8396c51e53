"""Benches of which there are several (`count: 2`): each has a name of its own, as it has a line and a device.

    benches: {rate_table: {count: 2, …}}    rate_table, rate_table-2

Tests name the first one. Loads of units go to whichever is free; steps say on which they are.
"""

from __future__ import annotations

from planner.spec.model import Bench, Spec


def copies(name: str, count: int) -> tuple[str, ...]:
    """The names of all benches of one entry."""
    return (name, *(f"{name}-{i}" for i in range(2, count + 1)))


def with_copies(spec: Spec) -> Spec:
    """The spec with every bench by its own name."""
    if all(bench.count == 1 for bench in spec.benches.values()):
        return spec
    found: dict[str, Bench] = {}
    for name, bench in spec.benches.items():
        further = bench.model_copy(update={"kind": bench.kind or name, "count": 1})
        found |= {own: bench if own == name else further for own in copies(name, bench.count)}
    return spec.model_copy(update={"benches": found})

"""The motions of a test, by axis: as the spec says them, or the standard ones of its kind of bench."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from planner import catalog
from planner.protocols import BenchKind
from planner.spec.model import Bench, Motion, Test
from planner.spec.ramp import WAYS
from planner.units import from_si

AxisMotion = Mapping[str, float]

WITHOUT_DRIVE = "levelled_plate"  # the unit is put on its faces by hand


def motions_of(name: str, bench: Bench, test: Test) -> Sequence[AxisMotion | None]:
    """One entry a record: axis -> deg, deg/s or g; None where a bench of no known kind only counts them.

    On a ramp every motion stands twice: for its record on the way up, and on the way down.
    """
    once = _once(name, bench, test)
    return once if test.ramp is None else [motion for motion in once for _ in WAYS]


def _once(name: str, bench: Bench, test: Test) -> Sequence[AxisMotion | None]:
    if not isinstance(test.motions, int):
        return [_by_axis(motion) for motion in test.motions]
    kind = catalog.benches().get(bench.kind or name)
    return [None] * test.motions if kind is None else _standard(kind, bench, test)


def may_be_turned_by_hand(name: str, bench: Bench) -> bool:
    """Whether there are motions at which a person turns the unit on this bench."""
    return (bench.kind or name) == WITHOUT_DRIVE or bench.axes == 1


def turned_by_hand(name: str, bench: Bench, motions: Sequence[AxisMotion | None]) -> tuple[bool, ...]:
    """For every motion whether a person turns the unit before it: on a plate always, on an arm of one axis
    when the sign of the load changes. The repeats of a test follow one another, so the motion before the
    first is the last.
    """
    if (bench.kind or name) == WITHOUT_DRIVE:
        return (True,) * len(motions)
    if bench.axes > 1:
        return (False,) * len(motions)
    loads = [(motion or {}).get("acceleration_g", 0.0) for motion in motions]
    return tuple(before * load < 0 for before, load in zip([loads[-1], *loads], loads, strict=False))


def _standard(kind: BenchKind, bench: Bench, test: Test) -> Sequence[AxisMotion]:
    limits = bench.limits
    return kind.motions(
        test.different_motions,
        bench.axes,
        calibrates=test.calibrates,
        rate_limit_dps=math.inf if limits.rate is None else from_si(limits.rate, "deg/s"),
        load_limit_g=math.inf if limits.acceleration is None else from_si(limits.acceleration, "g"),
    )


def _by_axis(motion: Motion) -> AxisMotion:
    units = {"position": ("deg", "deg"), "rate": ("deg/s", "dps"), "acceleration": ("g", "g")}
    found = {}
    for key, value in motion.model_dump(exclude_none=True).items():
        unit, suffix = units[key.split("_")[0]]
        found[f"{key}_{suffix}"] = round(from_si(value, unit), 9)
    return found

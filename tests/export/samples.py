"""Plans to export: those of the shipped specs, and small ones made by hand."""

from __future__ import annotations

import copy

from planner.export.header import plan_sha256
from tests.shipped_plans import shipped_document


def shipped(name: str, **arms: float | None) -> dict:
    """The plan of a shipped spec, steps shared between tests; `arms`: bench -> its arm in metres."""
    document = shipped_document(name)
    benches = copy.deepcopy(document["benches"])
    for bench, arm in arms.items():
        if bench in benches:
            benches[bench]["arm_m"] = arm
    return resealed(document | {"benches": benches})


def cut(name: str, steps: int = 80) -> dict:
    """A real plan, cut to a size that can be copied a hundred times; all of it may be changed."""
    document = shipped_document(name)
    return resealed(copy.deepcopy(document | {"steps": document["steps"][:steps]}))


def resealed(document: dict) -> dict:
    """The plan with the hash of what it now says."""
    return document | {"plan_sha256": plan_sha256(document)}


def bench(**changes: object) -> dict:
    """A rate table with a chamber."""
    facts = {
        "kind": "rate_table",
        "axes": 2,
        "units": 1,
        "room_degc": 20,
        "arm_m": None,
        "limits": {"rate_dps": 600, "angular_acceleration_dps2": 500, "acceleration_g": None},
        "chamber": {
            "coldest_degc": -65,
            "hottest_degc": 85,
            "heating_k_per_min": 4,
            "cooling_k_per_min": 2,
            "soak_s": 600,
        },
    }
    return facts | changes


def small(steps: list[tuple[str, float, dict]], **benches: dict) -> dict:
    """A plan of (action, seconds, further keys) one after the other; bench `table` unless a step says."""
    clock, made = 0.0, []
    for number, (action, seconds, more) in enumerate(steps):
        step = {
            "id": f"table/{number}/{action}",
            "bench": "table",
            "action": action,
            "start_s": clock,
            "end_s": clock + seconds,
            "test": None,
            "temperature_degc": 20,
            "repeat": None,
            "motion": None,
            "units": 1,
        }
        made.append(step | more)
        clock = made[-1]["end_s"]
    document = shipped_document("published_one_bench") | {
        "benches": benches or {"table": bench()},
        "steps": made,
        "time_s": clock,
    }
    return resealed(copy.deepcopy(document))


def turning(motion: dict, *, move: float = 5.0, **facts: object) -> dict:
    """Install, one motion with its record, remove."""
    steps = [
        ("install", 600.0, {}),
        ("power_on", 30.0, {}),
        ("move", move, {"motion": motion}),
        ("record", 20.0, {"motion": motion}),
        ("power_off", 0.0, {}),
        ("cool_down", 60.0, {}),
        ("remove", 300.0, {}),
    ]
    return small(steps, table=bench(**facts))

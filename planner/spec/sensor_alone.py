"""A spec of the sensor alone: `planner`, `unit`, `effects`, for what asks nothing of a flight or a bench.

What is missing is filled with parts that say nothing, behind the user's own text so that his lines keep their
numbers, and named in `absent`: whoever needs one of them asks for it by `needs`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from planner.errors import Fault, InputError
from planner.spec.load import LoadedSpec, checked_parts, read_document, spec_from_bytes

FILLING = {
    "name": "name: the sensor alone",
    "requirement": "requirement: [{error: position, limit: 1000000 m, rule: rss}]",
    "trajectory": "trajectory: static",
    "benches": "benches: {rate_table: {axes: 2, units: 1, limits: {rate: 600 deg/s}}}",
    "tests": "tests: {static: {bench: rate_table, calibrates: [gyro.bias], motions: 1, record: 60 s}}",
}
ASKED = {
    "requirement": "what the navigation must achieve",
    "trajectory": "the flight",
    "benches": "what the benches can do",
    "tests": "the tests that calibrate",
}


def sensor_spec_from_bytes(data: bytes, path: Path) -> LoadedSpec:
    """A whole spec as `load_spec`, or one of the sensor alone, with `absent` naming what it lacks.

    Raises InputError with every fault of the parts that are there.
    """
    document = read_document(data, path)
    absent = tuple(key for key in FILLING if key not in document.value)
    if not set(absent) & set(ASKED):
        return spec_from_bytes(data, path)
    filled = data.rstrip() + b"\n" + "".join(f"{FILLING[key]}\n" for key in absent).encode()
    loaded = checked_parts(filled, path, ("planner", "unit", "effects", "plan"), data)
    return replace(loaded, absent=absent)


def needs(loaded: LoadedSpec, what: str, *keys: str) -> None:
    """Raises InputError where the spec lacks what an answer needs."""
    lacking = [key for key in keys if key in loaded.absent]
    if lacking:
        faults = [Fault(str(loaded.path), 0, 0, key, f"is missing; {ASKED[key]}", "P102") for key in lacking]
        raise InputError(f"{loaded.path.name} is of the sensor alone; {what} needs more of it", faults)

"""calibration.json: coefficients with intervals, tables that correct a reading, what is not determined.

Display units stand beside every number; `tables` are in the units of their names. `random.json` holds the
spreads by themselves: the seed of a Kalman filter (K 3.1).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner import catalog
from planner.errors import InputError
from planner.export.json_figures import figure, json_text, shown
from planner.nouns.calibration import (
    Calibration,
    Coefficient,
    ExtraTerm,
    RandomCharacteristic,
    Residual,
    SensorCalibration,
    SmoothTable,
    Tables,
)
from planner.nouns.calibration_file import calibration_tree
from planner.protocols import SENSORS, Sensor
from planner.units import from_si, unit_factor

OUTPUT_UNIT = {"gyro": "deg/s", "accelerometer": "g"}
SUFFIX = {"deg/s": "dps", "g": "g"}
SCHEMA_VERSION = 1


def calibration_document(calibration: Calibration) -> dict[str, Any]:
    """The tree of calibration.json."""
    return {
        "planner": calibration.version,
        "schema_version": SCHEMA_VERSION,
        "unit": calibration.unit,
        "data": calibration.source,
        "spec": {"name": calibration.spec_name, "sha256": calibration.spec_sha256},
        "sensors": {s.sensor: _sensor(s) for s in calibration.sensors},
        **_plugins(calibration),
        "notes": list(calibration.notes),
    }


def _plugins(calibration: Calibration) -> dict[str, Any]:
    """The effects of other packages that correcting needs, and where they come from; no key without any."""
    names = sorted({e.effect for s in calibration.sensors for e in s.tables.extra})
    origins = [o for name in names if (o := catalog.origins("effects").get(name)) is not None]
    found = [origin.document() for origin in origins if origin.foreign]
    return {"plugins": found} if found else {}


def calibration_text(calibration: Calibration) -> str:
    """calibration.json. The same calibration gives the same bytes."""
    return json_text(calibration_document(calibration))


def random_text(calibration: Calibration) -> str:
    """random.json: every spread of every channel with its interval."""
    return json_text(
        {
            "planner": calibration.version,
            "unit": calibration.unit,
            "data": calibration.source,
            "random": {s.sensor: [_random(r) for r in s.random] for s in calibration.sensors},
        }
    )


def _sensor(found: SensorCalibration) -> dict[str, Any]:
    unit = OUTPUT_UNIT[found.sensor]
    return {
        "method": found.method,
        "coefficients": [_coefficient(c) for c in found.coefficients],
        "undetermined": [_named(c) for c in found.coefficients if c.status == "undetermined"],
        "condition": {channel: figure(value) for channel, value in found.condition.items()},
        "correlation": {channel: _correlation(matrix) for channel, matrix in found.covariance.items()},
        "residual": {f"{found.sensor}_{r.channel}": _residual(r, unit) for r in found.residuals},
        "tables": _tables(found.tables, unit),
        **({"smooth": [_smooth(s) for s in found.smooth]} if found.smooth else {}),
        "notes": list(found.notes),
    }


def _named(c: Coefficient) -> dict[str, Any]:
    return {"error": c.error, "channel": c.channel, "term": c.term, "temperature_degc": c.temperature_degc}


def _coefficient(c: Coefficient) -> dict[str, Any]:
    known = c.status != "undetermined"
    return {
        **_named(c),
        "value": shown(c.value, c.unit) if known else None,
        "unit": c.unit,
        "standard_error": shown(c.standard_error, c.unit) if known else None,
        "ci95": [shown(c.low, c.unit), shown(c.high, c.unit)] if known else None,
        "degrees_of_freedom": figure(round(c.freedom, 2)) if math.isfinite(c.freedom) else None,
        "status": c.status,
    }


def _correlation(covariance: np.ndarray) -> list[list[float]]:
    error = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(error > 0, error, 1.0)
    return [[round(float(x), 6) for x in row] for row in covariance / np.outer(scale, scale)]


def _residual(r: Residual, unit: str) -> dict[str, Any]:
    return {
        "unit": unit,
        "before": shown(r.before, unit),
        "after": shown(r.after, unit),
        "after_in_sample": shown(r.in_sample, unit),
        "held_out": r.held_out,
        "rows": r.rows,
        "runs": r.runs,
        "how": r.how,
    }


def _random(r: RandomCharacteristic) -> dict[str, Any]:
    base = r.unit.removesuffix(" s^(1/2)")
    return {
        "kind": r.kind,
        "error": r.error,
        "channel": r.channel,
        "value": shown(r.value, base),
        "unit": f"({base})·√s" if r.unit != base else base,
        "ci95": [shown(r.low, base), shown(r.high, base)],
        "measured": r.measured,
    }


def _smooth(s: SmoothTable) -> dict[str, Any]:
    low, high = ([shown(float(x), s.unit) for x in ends] for ends in (s.low, s.high))
    return {
        "error": s.error,
        "channel": s.channel,
        "term": s.term,
        "unit": s.unit,
        "temperature_degc": [float(t) for t in s.temperature_degc],
        "value": [shown(float(x), s.unit) for x in s.value],
        "standard_error": [shown(float(x), s.unit) for x in s.standard_error],
        "ci95": [list(pair) for pair in zip(low, high, strict=True)],
        "size": {"value": figure(s.size[0]), "ci95": [figure(x) for x in s.size[1:]]},
        "missed_between_nodes": shown(float(np.abs(s.missed).max()), s.unit),
    }


def _tables(tables: Tables, unit: str) -> dict[str, Any]:
    suffix = SUFFIX[unit]
    return {
        "temperature_degc": [float(t) for t in tables.temperature_degc],
        f"bias_{suffix}": [[from_si(float(b), unit) for b in row] for row in tables.bias],
        "scale_factor": [[float(k) for k in row] for row in tables.scale],
        "asymmetry": [float(a) for a in tables.asymmetry],
        "misalignment": [[float(m) for m in row] for row in tables.misalignment],
        "extra": [_extra(e) for e in tables.extra],
        "reach_k": tables.reach,
    }


def _extra(e: ExtraTerm) -> dict[str, Any]:
    return {"effect": e.effect, "term": e.term, "value_si": e.value, "nonlinear_si": dict(e.nonlinear)}


# ---------------------------------------------------------------- reading back


def read_tables(path: Path) -> dict[Sensor, Tables]:
    """Sensor -> tables of a calibration.json, or of the folder that has one.

    Raises InputError for a file that cannot be read or is no calibration.
    """
    file, document = calibration_tree(path)
    try:
        sensors = {s: document["sensors"][s]["tables"] for s in SENSORS if s in document["sensors"]}
        _check_effects(sensors, document.get("plugins", []), file)
        return {s: _tables_from(tables, s) for s, tables in sensors.items()}
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise InputError(f"{file} is no calibration.json of planner: {error!r}") from error


def _tables_from(document: Mapping[str, Any], sensor: Sensor) -> Tables:
    unit = OUTPUT_UNIT[sensor]
    found = Tables(
        temperature_degc=np.array(document["temperature_degc"], dtype=float),
        bias=np.array(document[f"bias_{SUFFIX[unit]}"], dtype=float) * unit_factor(unit)[0],
        scale=np.array(document["scale_factor"], dtype=float),
        asymmetry=np.array(document["asymmetry"], dtype=float),
        misalignment=np.array(document["misalignment"], dtype=float),
        extra=tuple(
            ExtraTerm(e["effect"], e["term"], float(e["value_si"]), dict(e["nonlinear_si"]))
            for e in document["extra"]
        ),
        reach=float(document["reach_k"]),
    )
    _check_tables(found)
    return found


def _check_tables(tables: Tables) -> None:
    """Raises ValueError for arrays that do not belong together."""
    nodes = len(tables.temperature_degc)
    shapes = [tables.bias.shape, tables.scale.shape, tables.asymmetry.shape, tables.misalignment.shape]
    if nodes < 1 or shapes != [(3, nodes), (3, nodes), (3,), (3, 3)]:
        raise ValueError("its tables have the wrong shape")
    numbers = [tables.temperature_degc, tables.bias, tables.scale, tables.asymmetry, tables.misalignment]
    if not all(np.isfinite(x).all() for x in numbers) or (np.diff(tables.temperature_degc) <= 0).any():
        raise ValueError("its tables are not finite, or their temperatures do not rise")


def _check_effects(
    sensors: Mapping[Sensor, Mapping[str, Any]], plugins: Sequence[Mapping[str, Any]], file: Path
) -> None:
    """Raises InputError for effects that nothing here offers, ValueError for terms that they do not have."""
    known = catalog.effects()
    packages = {p["name"]: f"{p['distribution']} {p['version']}" for p in plugins}
    for sensor, tables in sensors.items():
        for e in tables["extra"]:
            name = e["effect"]
            if name not in known:
                whose = f"install {packages[name]}" if name in packages else "install the package that has it"
                raise InputError(f"{file} needs the effect {name!r}, which is not installed here; {whose}")
            terms = [t.name for t in known[name].terms(sensor)] if sensor in known[name].sensors else []
            strange = set(e["nonlinear_si"]) - set(known[name].nonlinear)
            if e["term"] not in terms or strange:
                what = f"no parameter {sorted(strange)[0]!r}" if strange else f"no term {e['term']!r}"
                raise ValueError(f"{name} has {what} on {sensor}s")

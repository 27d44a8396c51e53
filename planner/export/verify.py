"""verify.json: what the verification found, in display units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from planner.export.json import number
from planner.nouns.array import Array
from planner.spec.model import NAVIGATION_ERRORS
from planner.units import from_si
from planner.verify.outcome import Claim, Part, RequirementOutcome, TypesOutcome
from planner.verify.recount import Recount
from planner.verify.through_files import ThroughFiles
from planner.verify.verification import Verification


def verify_document(v: Verification) -> dict[str, Any]:
    """Everything as a tree of plain values; figures that are infinite are null."""
    return {
        "planner": v.version,
        "spec": {"name": v.name, "sha256": v.spec_sha256},
        "plan_sha256": v.plan_sha256,
        "verdict": v.verdict,
        "recount": recount_document(v.recount),
        "through_files": _files(v.files),
        "flights": v.flights,
        "flights_wanted": v.wanted,
        "stopped": v.stopped,
        "seed": v.seed,
        "temperature": v.temperature,
        "curves": v.curves,
        "flight": v.flown,
        "requirements": [_requirement(o) for o in v.worst],
        "families": {
            family: {str(o.index): _in_family(o) for o in v.outcomes if o.family == family}
            for family in v.families
        },
        "claims": [_claim(c) for c in v.claims],
        "weak": [{"error": w.error, "axis": w.axis, "why": w.why} for w in v.weak],
        "linear": [
            {
                "times": number(p.factor),
                "share_of_flight": number(p.share),
                "apart": _finite(p.apart),
                "error": _finite(p.size),
            }
            for p in v.linear
        ],
        "notes": list(v.notes),
    }


def recount_document(recount: Recount) -> dict[str, Any]:
    """The checks, and every fault."""
    return {
        "ok": recount.ok,
        "checks": [
            {"check": c.name, "what": c.what, "ok": c.ok, "figures": c.figures} for c in recount.checks
        ],
        "faults": list(map(asdict, recount.faults)),
        "not_recounted": list(recount.not_recounted),
    }


def _files(files: ThroughFiles) -> dict[str, Any]:
    """Units that went the whole way through files, and what is wrong with them."""
    return {
        "ok": files.ok,
        "units": files.units,
        "checks": [
            {
                "unit": c.unit,
                "error": c.error,
                "in": NAVIGATION_ERRORS[c.error],
                **{
                    key: _in(value, NAVIGATION_ERRORS[c.error])
                    for key, value in (
                        ("through_files", c.through_files),
                        ("directly", c.directly),
                        ("apart", c.apart),
                        ("may_be_apart", c.may),
                    )
                },
            }
            for c in files.checks
        ],
        "faults": list(map(asdict, files.faults)),
    }


def _finite(value: float) -> float | int | None:
    return number(value) if math.isfinite(value) else None


def _in(value: float, unit: str) -> float | int | None:
    return _finite(from_si(value, unit) if math.isfinite(value) else value)


def _requirement(o: RequirementOutcome) -> Mapping[str, Any]:
    return {
        "error": o.error,
        "at": o.at,
        "instants": {"count": len(o.instants), "apart_s": _apart(o.instants)},
        "rule": o.rule,
        "family": o.family,
        "temperature": o.starts,
        "unit": o.unit,
        "limit": _in(o.limit, o.unit),
        "verdict": o.verdict,
        "promised": o.promised,
        "share": number(o.share),
        "ci95": [number(o.low), number(o.high)],
        "rms": _in(o.rms, o.unit),
        "rms_ci95": [_in(o.rms_low, o.unit), _in(o.rms_high, o.unit)],
        "percentiles": {f"{p:g}": _in(value, o.unit) for p, value in o.percentiles},
        "largest": _in(o.largest, o.unit),
        "achieved": _in(o.achieved, o.unit),
        "at_promise": _in(o.at_promise, o.unit),
        "foreseen": None if o.foreseen is None else _in(o.foreseen, o.unit),
        "pessimism": _finite(o.pessimism),
        "nonlinear_apart": _finite(o.apart),
        "too_small": list(o.too_small),
        "types": None if o.types is None else _types(o.types),
        "parts": [_part(p, o.unit) for p in o.parts],
    }


def _types(types: TypesOutcome) -> Mapping[str, Any]:
    """Types of unit with true spreads of their own: in which share the promise is kept."""
    return {
        "types": types.types,
        "share": number(types.share),
        "ci95": [number(types.low), number(types.high)],
        "promised": number(types.promised),
    }


def _apart(instants: Array) -> float | int | None:
    """Seconds between instants, at most; of a single one nothing."""
    return number(float(np.diff(instants).max())) if len(instants) > 1 else None


def _in_family(o: RequirementOutcome) -> Mapping[str, Any]:
    """One requirement in one family of curves: predicted, flown, and the verdict."""
    every = _requirement(o)
    keys = (
        "temperature",
        "verdict",
        "share",
        "ci95",
        "rms",
        "rms_ci95",
        "achieved",
        "at_promise",
        "foreseen",
        "pessimism",
        "types",
    )
    return {key: every[key] for key in keys}


def _part(p: Part, unit: str) -> Mapping[str, Any]:
    return {
        "error": p.error,
        "part": p.part,
        "adds": _in(p.adds, unit),
        "share": _finite(p.share),
        "size": _in(p.size, p.unit),
        "largest": _in(p.largest, p.unit),
        "planned": _in(p.planned, p.unit),
        "unit": p.unit,
    }


def _claim(c: Claim) -> Mapping[str, Any]:
    return {
        "error": c.error,
        "share": number(c.share),
        "ci95": [number(c.low), number(c.high)],
        "claimed": number(c.claimed),
    }

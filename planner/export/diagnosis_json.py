"""diagnosis.json: what the declared model lacks, on what evidence, before and after (interfaces, section 6).

Display units stand beside every number; null is a figure that the data cannot give. Channels are written
`gyro_x` … `acc_z`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from planner import catalog
from planner.errors import InputError
from planner.export.diagnosis_findings import findings_document, findings_from, float_from
from planner.export.documents import json_tree
from planner.export.json_figures import figure, json_text, shown
from planner.nouns.diagnosed_spreads import Assumption, CampaignCost
from planner.nouns.diagnosis import (
    Diagnosis,
    FoundEffect,
    FoundTerm,
    NavigationCost,
    NextMeasurement,
    NotFound,
    ResidualChange,
    Rival,
    UnitDiagnosis,
    Unknown,
    Untestable,
)
from planner.nouns.given_files import DIAGNOSIS
from planner.nouns.sensor import short
from planner.units import UnitError, unit_factor

SCHEMA_VERSION = 1
REQUIRED = ("verdict", "effects", "residual", "spec", "unit")


def diagnosis_document(diagnosis: Diagnosis) -> dict[str, Any]:
    """The tree of diagnosis.json."""
    found = diagnosis.found
    return {
        "planner": diagnosis.version,
        "schema_version": SCHEMA_VERSION,
        "unit": found.unit,
        "data": {"file": diagnosis.source, "sha256": diagnosis.data_sha256},
        "spec": {"name": diagnosis.spec_name, "sha256": diagnosis.spec_sha256},
        "seed": diagnosis.seed,
        "verdict": found.verdict,
        "effects": [_effect(e) for e in found.effects],
        "unknown": [
            {
                "channels": [short(c) for c in u.channels],
                "varies_with": u.varies_with,
                "p_value": figure(u.p_value),
                "strength_sigma": figure(u.strength),
                "curve": None if u.curve is None else _effect(u.curve),
            }
            for u in found.unknown
        ],
        "not_found": [
            {
                "effect": n.effect,
                "upper_limit95": shown(n.upper_limit, n.unit),
                "unit": n.unit,
                "sensor": n.sensor,
                "nonlinear": _parameters(n.nonlinear),
                "terms": list(n.terms),
            }
            for n in found.not_found
        ],
        "untestable": [{"effect": u.effect, "why": u.why, "sensor": u.sensor} for u in found.untestable],
        **findings_document(found),
        "residual": {short(r.channel): _residual(r) for r in diagnosis.residual},
        "navigation": _first_navigation(diagnosis),
        "navigation_of_every_requirement": [_navigation(n) for n in diagnosis.navigation],
        "campaign": _campaign(diagnosis.campaign),
        "next_measurement": [_measurement(m) for m in diagnosis.next_measurement],
        "assumptions": [_assumption(a) for a in found.assumptions],
        "notes": [*diagnosis.notes, *found.notes],
    }


def diagnosis_text(diagnosis: Diagnosis) -> str:
    """diagnosis.json. The same data, spec and seed give the same bytes."""
    return json_text(diagnosis_document(diagnosis))


def _effect(e: FoundEffect) -> dict[str, Any]:
    return {
        "effect": e.effect,
        "channels": [short(c) for c in e.channels],
        "terms": [_term(t) for t in e.terms],
        "p_value": figure(e.p_value),
        "rivals": [{"effect": r.effect, "separated_by": figure(r.separated_by)} for r in e.rivals],
        "below_bench_uncertainty": e.below_bench_uncertainty,
        "sensor": e.sensor,
        "strength_sigma": figure(e.strength),
        "nonlinear": _parameters(e.nonlinear),
    }


def _parameters(nonlinear: Mapping[str, float]) -> dict[str, float | None]:
    return {name: figure(value) for name, value in nonlinear.items()}


def _term(t: FoundTerm) -> dict[str, Any]:
    value, low, high = (figure(x / t.scale) for x in (t.value, t.low, t.high))
    return {
        "name": t.name,
        "value": value,
        "unit": t.unit,
        "ci95": [low, high],
        "channel": short(t.channel),
        "degrees_of_freedom": figure(t.freedom),
        "nonlinear": t.parameter,
    }


def _residual(r: ResidualChange) -> dict[str, Any]:
    def ours(value: float) -> float | None:
        return shown(value, r.unit)

    return {
        "unit": r.unit,
        "before": {"rms": ours(r.before), "ci95": [ours(r.before_low), ours(r.before_high)]},
        "after": {"rms": ours(r.after), "ci95": [ours(r.after_low), ours(r.after_high)]},
        "within_run_before": ours(r.within_before),
        "within_run_after": ours(r.within_after),
        "noise_floor": ours(r.noise_floor),
        "noise_floor_within_run": ours(r.noise_floor_within),
        "within_run_before_sigma": figure(r.sigma_before),
        "within_run_after_sigma": figure(r.sigma_after),
        "weighed_before_sigma": figure(r.weighed_before),
        "weighed_after_sigma": figure(r.weighed_after),
        "fall_within_run": figure(r.falls),
        "record": {
            "noise": ours(r.white),
            "share_of_input": figure(r.stray),
            "record_s": figure(r.record),
        },
        "held_out": r.held_out,
        "held_out_by": r.split,
        "rows": r.rows,
        "runs": r.runs,
        "how": r.how,
    }


def _campaign(c: CampaignCost | None) -> dict[str, Any] | None:
    """Seconds of the campaign with the spec's budgets, and with the spreads that were measured."""
    if c is None:
        return None
    return {"time_s": figure(c.before), "time_as_measured_s": figure(c.after), "why": c.why or None}


def _first_navigation(diagnosis: Diagnosis) -> dict[str, Any]:
    if diagnosis.navigation:
        return _navigation(diagnosis.navigation[0])
    nothing = 0.0 if not diagnosis.found.unknown and diagnosis.found.verdict == "clean" else None
    why = "nothing was found that could cost anything" if nothing == 0.0 else "no effect was named"
    return {"error": None, "unit": None, "before": nothing, "after": nothing, "how": why}


def _navigation(n: NavigationCost) -> dict[str, Any]:
    return {
        "error": n.error,
        "unit": n.unit,
        "before": shown(n.before, n.unit),
        "after": shown(n.after, n.unit),
        "limit": shown(n.limit, n.unit),
        "before_as_calibrated": shown(n.as_calibrated, n.unit),
        "promised": shown(n.promised, n.unit),
        "total_before": shown(n.total_before, n.unit),
        "total_after": shown(n.total_after, n.unit),
        "compensation_helps": n.helps,
        "confidence": figure(n.confidence),
        "how": n.how,
    }


def _measurement(m: NextMeasurement) -> dict[str, Any]:
    return {
        "separates": list(m.separates),
        "condition": {
            "bench": m.bench,
            "test": m.test,
            **{k: v if isinstance(v, str) else figure(v) for k, v in m.condition.items()},
        },
        "separation": figure(m.separation),
        "time_s": figure(m.time_s),
    }


def _assumption(a: Assumption) -> dict[str, Any]:
    return {
        "error": a.error,
        "channel": short(a.channel) or None,
        "part": a.part,
        "unit": a.unit,
        "assumed": None if a.assumed is None else shown(a.assumed, a.unit),
        "measured": shown(a.measured, a.unit),
        "ci95": [shown(a.low, a.unit), shown(a.high, a.unit)],
        "degrees_of_freedom": figure(a.freedom),
    }


# ---------------------------------------------------------------- reading back


def read_diagnosis(path: Path) -> Diagnosis:
    """A diagnosis.json, or the folder that has one, without the evidence that only the report draws.

    Raises InputError for a file that cannot be read or is no diagnosis.
    """
    file = path / "diagnosis.json" if path.is_dir() else path
    if path.is_dir() and not file.exists():
        several = sorted(p.parent.name for p in path.glob("*/diagnosis.json"))
        if several:
            raise InputError(f"{path} holds the diagnoses of {', '.join(several)}; name one of these folders")
    document = json_tree(file, "is no diagnosis", REQUIRED, DIAGNOSIS)
    try:
        return _diagnosis(document)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, UnitError) as error:
        raise InputError(f"{file} is no diagnosis.json of planner: {error!r}") from error


def _diagnosis(d: Mapping[str, Any]) -> Diagnosis:
    every = d.get("navigation_of_every_requirement", ())
    return Diagnosis(
        found=UnitDiagnosis(
            unit=str(d["unit"]),
            verdict=d["verdict"],
            effects=tuple(_effect_from(e) for e in d["effects"]),
            unknown=tuple(
                Unknown(
                    tuple(u["channels"]),
                    u["varies_with"],
                    float_from(u["p_value"]),
                    float_from(u.get("strength_sigma")),
                    _effect_from(u["curve"]) if u.get("curve") else None,
                )
                for u in d["unknown"]
            ),
            not_found=tuple(_not_found_from(n) for n in d["not_found"]),
            untestable=tuple(Untestable(u["effect"], u["sensor"], u["why"]) for u in d["untestable"]),
            evidence=(),
            assumptions=tuple(_assumption_from(a) for a in d.get("assumptions", ())),
            **findings_from(d),
        ),
        residual=tuple(_residual_from(name, r) for name, r in d["residual"].items()),
        navigation=tuple(_navigation_from(n) for n in every),
        next_measurement=tuple(_measurement_from(m) for m in d["next_measurement"]),
        version=d["planner"],
        spec_name=d["spec"]["name"],
        spec_sha256=d["spec"]["sha256"],
        data_sha256=d["data"]["sha256"],
        source=d["data"]["file"],
        seed=int(d["seed"]),
        notes=tuple(d.get("notes", ())),
        campaign=_campaign_from(d.get("campaign")),
    )


def _campaign_from(c: Mapping[str, Any] | None) -> CampaignCost | None:
    if c is None:
        return None
    return CampaignCost(float_from(c["time_s"]), float_from(c["time_as_measured_s"]), c.get("why") or "")


def _not_found_from(n: Mapping[str, Any]) -> NotFound:
    limit, at = _si(n["upper_limit95"], n["unit"]), _parameters_from(n.get("nonlinear", {}))
    return NotFound(n["effect"], n["sensor"], limit, n["unit"], at, tuple(n.get("terms", ())))


def _effect_from(e: Mapping[str, Any]) -> FoundEffect:
    if e["effect"] not in catalog.effects():
        raise ValueError(f"unknown effect {e['effect']!r}")
    if e["sensor"] not in catalog.effects()[e["effect"]].sensors:
        raise ValueError(f"{e['effect']} does not exist on {e['sensor']!r}")
    return FoundEffect(
        effect=e["effect"],
        sensor=e["sensor"],
        channels=tuple(e["channels"]),
        terms=tuple(_term_from(t) for t in e["terms"]),
        p_value=float_from(e["p_value"]),
        strength=float_from(e["strength_sigma"]),
        rivals=tuple(Rival(r["effect"], float_from(r["separated_by"])) for r in e["rivals"]),
        below_bench_uncertainty=bool(e["below_bench_uncertainty"]),
        nonlinear=_parameters_from(e["nonlinear"]),
    )


def _parameters_from(nonlinear: Mapping[str, Any]) -> dict[str, float]:
    return {name: float_from(v) for name, v in nonlinear.items()}


def _term_from(t: Mapping[str, Any]) -> FoundTerm:
    bare = FoundTerm(
        t["name"],
        t["channel"],
        0.0,
        0.0,
        0.0,
        float_from(t["degrees_of_freedom"]),
        t["unit"],
        bool(t["nonlinear"]),
    )
    value, low, high = (float_from(x) * bare.scale for x in (t["value"], *t["ci95"]))
    return replace(bare, value=value, low=low, high=high)


def _residual_from(name: str, r: Mapping[str, Any]) -> ResidualChange:
    unit = r["unit"]
    ends = {key: [_si(x, unit) for x in r[key]["ci95"]] for key in ("before", "after")}
    return ResidualChange(
        channel=name,
        unit=unit,
        before=_si(r["before"]["rms"], unit),
        before_low=ends["before"][0],
        before_high=ends["before"][1],
        after=_si(r["after"]["rms"], unit),
        after_low=ends["after"][0],
        after_high=ends["after"][1],
        within_before=_si(r["within_run_before"], unit),
        within_after=_si(r["within_run_after"], unit),
        noise_floor=_si(r["noise_floor"], unit),
        rows=int(r["rows"]),
        runs=int(r["runs"]),
        held_out=bool(r["held_out"]),
        how=r["how"],
        noise_floor_within=_si(r["noise_floor_within_run"], unit),
        sigma_before=float_from(r["within_run_before_sigma"]),
        sigma_after=float_from(r["within_run_after_sigma"]),
        weighed_before=float_from(r.get("weighed_before_sigma")),
        weighed_after=float_from(r.get("weighed_after_sigma")),
        falls=float_from(r.get("fall_within_run")),
        white=_si(r["record"]["noise"], unit),
        stray=float_from(r["record"]["share_of_input"]),
        record=float_from(r["record"]["record_s"]),
        split=r.get("held_out_by", "runs"),
    )


def _navigation_from(n: Mapping[str, Any]) -> NavigationCost:
    unit = n["unit"]
    return NavigationCost(
        n["error"],
        unit,
        _si(n["before"], unit),
        _si(n["after"], unit),
        float_from(n["confidence"]),
        n["how"],
        _si(n["before_as_calibrated"], unit),
        _si(n["limit"], unit),
        _si(n.get("promised"), unit),
    )


def _measurement_from(m: Mapping[str, Any]) -> NextMeasurement:
    condition = {k: v for k, v in m["condition"].items() if k not in ("bench", "test")}
    first, second = m["separates"]
    return NextMeasurement(
        (first, second),
        m["condition"]["bench"],
        m["condition"]["test"],
        condition,
        float_from(m["separation"]),
        float_from(m["time_s"]),
    )


def _assumption_from(a: Mapping[str, Any]) -> Assumption:
    unit = a["unit"]
    return Assumption(
        a["error"],
        a["part"],
        unit,
        None if a["assumed"] is None else _si(a["assumed"], unit),
        _si(a["measured"], unit),
        _si(a["ci95"][0], unit),
        _si(a["ci95"][1], unit),
        float_from(a["degrees_of_freedom"]),
        a.get("channel") or "",
    )


def _si(value: Any, unit: str) -> float:
    return float_from(value) * unit_factor(unit)[0]

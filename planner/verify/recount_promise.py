"""What a plan by information promises, counted again: figures of every family, parts of every error, shares.

A dense least-squares problem of the whole campaign, from the plan's steps, says what its records do to the
estimates; every chance is followed into flight by itself (foreseen), through the linear model of the
flights that verify flies nonlinearly. The planner adds up information matrices of kinds of power-on instead.

Both sides draw the curves of a family. 20 000 of them here for the mean of f fᵀ: of the family whose scale
varies most, Matérn, it is then known to 2.5 %, a sigma made of curves alone to 1.2 %; for quantiles 12 000 or
more in 60 000 flights. The planner draws its own, and curves make at most two thirds of a figure's squares on
the shipped specs: SAME. Quantiles of nearly all flights are made of few curves and flights: what they may err
is counted (drawn_figures), and two that differ by no more than SIGMAS of it are the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.spec.curve_names import families_of
from planner.spec.model import NAVIGATION_ERRORS, Requirement, Spec
from planner.units import unit_factor
from planner.verify.calibrations import estimators
from planner.verify.chance import chance_of
from planner.verify.drawn_figures import Quantile
from planner.verify.experiment import Experiment
from planner.verify.findings import Document, Findings
from planner.verify.foreseen import PARTS, Asked, Foresight
from planner.verify.outcome import sigmas_planned
from planner.verify.prediction import DrawnCurves, Parts, Prediction, Row
from planner.verify.recount_budget import budgets_of, calibrated_errors
from planner.verify.references import directions
from planner.verify.second_moments import Error
from planner.verify.starts import Starts, anywhere, starts_of
from planner.verify.strays import strays_of

SAME = 0.02
SIGMAS = 4.2  # of a quantile: three of the difference of two that are drawn alike
NOTHING = 1e-6  # of a limit, or of an error before calibration: perfect records leave rounding
_EXACT = 1e-9


def as_planned(e: Experiment, curves: DrawnCurves | None = None) -> Prediction | None:
    """What the plan of an experiment promises; None where nothing is flown.

    curves: of the spec, if they are drawn already
    """
    if e.flight is None:
        return None
    chance = chance_of(e.spec)
    off = directions(e.records, e.spec)
    curves = curves or DrawnCurves(e.spec)
    strays = strays_of(e.records, chance, curves.prior)
    known = estimators(e.records, e.unit, e.spec.effects, chance, off, curves.tables, strays)
    return Prediction(replace(e, chance=chance, estimators=known), e.flight, curves)


def check_promise(document: Document, p: Prediction | None) -> list[Findings]:
    """Families and their figures, allowances and their parts, shares."""
    if p is None:
        found = Findings("promise", _PROMISE)
        found.fault("method", "is information, but nothing can be flown: the spec gives the sensitivities")
        return [found]
    found = _check_families(document, p)
    if found.faults and not isinstance(document.get("families"), Mapping):
        return [found]
    return [found, _check_allowances(document, p), _check_covariance(document, p), _check_shares(document, p)]


_PROMISE = "what is promised in every family of curves is what the plan's own steps leave in flight"


def _binding(document: Document, spec: Spec, index: int) -> str:
    """The family that the plan says binds, or the first one if there is none of that name."""
    said, names = document["requirements"][index].get("family"), families_of(spec)
    return said if said in names else names[0]


def _starts(wanted: Requirement, spec: Spec) -> Starts:
    """Over which parts and shares are means: where only the worst counts, all of the range."""
    return starts_of(wanted, spec) or anywhere(spec)


# ---------------------------------------------------------------- figures


def _check_families(document: Document, p: Prediction) -> Findings:
    found, spec = Findings("promise", _PROMISE), p.e.spec
    said, names = document.get("families"), families_of(spec)
    if not isinstance(said, Mapping) or not found.same("families", sorted(said), sorted(names)):
        return found
    for i, (wanted, r) in enumerate(zip(spec.requirement, document["requirements"], strict=False)):
        factor = unit_factor(NAVIGATION_ERRORS[wanted.error])[0]
        for family, (figure, sigma) in figures_of(p, i, names).items():
            where = f"families, {family}, requirement {i}"
            within = max(SAME * figure, SIGMAS * sigma, NOTHING * wanted.limit.si) / factor
            stated = said[family].get(str(i))
            if found.same(where, isinstance(stated, int | float), True):
                found.near(where, stated, figure / factor, within)
        own = {family: said[family].get(str(i)) for family in names}
        if all(isinstance(x, int | float) for x in own.values()):
            most = max(own.values())
            found.same(f"requirements {i}, achieved", r["achieved"], most, _EXACT)
            found.same(f"requirements {i}, family", own.get(r.get("family")), most, _EXACT)
        found.same(f"requirements {i}, temperature", r.get("temperature"), temperature_words(wanted))
    return found


def figures_of(p: Prediction, index: int, names: tuple[str, ...]) -> dict[str, Quantile]:
    """Family -> figure of a requirement at its own temperatures, SI, and what it may err."""
    starts = starts_of(p.e.requirements[index], p.e.spec)
    return {family: p.quantile(index, family, starts or p.worst(index, family)) for family in names}


def temperature_words(wanted: Requirement) -> str:
    """A requirement's temperatures as plan.json has them."""
    if isinstance(wanted.temperature, str):
        return wanted.temperature
    shares = sorted(wanted.temperature.distribution.items())
    return "{" + ", ".join(f"{t:g} degC: {share:g}" for t, share in shares) + "}"


# ---------------------------------------------------------------- errors


def _check_allowances(document: Document, p: Prediction) -> Findings:
    found = Findings("allowances", "parts are the sigmas of an error's largest term in flight, squares add")
    z = sigmas_planned(document, p.e.spec)
    starts = _starts(p.e.requirements[0], p.e.spec)
    for error, own in sigmas_of(p, starts, _binding(document, p.e.spec, 0)).items():
        a = document["allowances"].get(error)
        if a is None:
            continue
        where = f"allowances, {error}"
        found.same(f"{where}, calibrated", a["calibrated"], error in calibrated_errors(p.e.spec))
        allowed = float(np.linalg.norm([a["parts"][part] for part in PARTS]))
        found.same(f"{where}, allowed", a["allowed"], allowed, _EXACT)
        factor = unit_factor(a["unit"])[0]
        within = max(SAME * allowed, NOTHING * budgets_of(p.e.spec)[error].whole_variation / factor)
        for part in PARTS:
            found.near(f"{where}, {part}", a["parts"][part], z * own[part] / factor, within)
    return found


def _check_covariance(document: Document, p: Prediction) -> Findings:
    found = Findings("covariance", "of all terms in flight: their own draws, estimates, curves, together")
    starts = _starts(p.e.requirements[0], p.e.spec)
    rows, parts = covariance_of(p, starts, _binding(document, p.e.spec, 0))
    names = [(str(ErrorName.of(*error)), term) for error, term in rows]
    units = {error: a["unit"] for error, a in document["allowances"].items()}
    kept = [
        i for i, (error, _) in enumerate(names) if error in units
    ]  # what a plan does not name is not told
    names = [names[i] for i in kept]
    said = document.get("covariance") or {}
    wanted = [{"error": error, "axis": term, "unit": units.get(error)} for error, term in names]
    if not found.same("covariance, requirement", said.get("requirement"), 0):
        return found
    if not found.same("covariance, terms", _by_name(said.get("terms")), _by_name(wanted)):
        return found
    order = [said["terms"].index(one) for one in wanted]
    matrix = np.array(said.get("matrix"), dtype=float)
    if not found.same("covariance, matrix", list(matrix.shape), [len(order)] * 2):
        return found
    scale = np.array([unit_factor(unit)[0] for unit in map(units.__getitem__, (e for e, _ in names))])
    _compare(
        found,
        matrix[np.ix_(order, order)] * np.outer(scale, scale),
        np.sum([*parts.values()], axis=0)[np.ix_(kept, kept)],
        names,
        np.array([NOTHING * budgets_of(p.e.spec)[error].whole_variation for error, _ in names]),
    )
    return found


def _by_name(terms: Any) -> list[str]:
    return sorted(map(str, terms)) if isinstance(terms, list) else []


def _compare(
    found: Findings, matrix: Array, wanted: Array, names: list[tuple[str, str]], least: Array
) -> None:
    """The figure that is farthest off, for the sigmas of its two terms, which count as `least` or more."""
    sigma = np.maximum(np.sqrt(np.diag(wanted)), least)
    scale = np.where(np.outer(sigma, sigma) > 0, np.outer(sigma, sigma), 1.0)
    i, j = np.unravel_index(int(np.argmax(np.abs(matrix - wanted) / scale)), matrix.shape)
    where = f"covariance, {' '.join(names[i])} with {' '.join(names[j])}"
    found.near(where, float(matrix[i, j]), float(wanted[i, j]), 2.0 * SAME * float(scale[i, j]))


def sigmas_of(p: Prediction, starts: Starts, family: str) -> dict[str, dict[str, float]]:
    """Error -> part -> sigma of its largest term when flights start, rms over the starts, SI."""
    rows, parts = covariance_of(p, starts, family)
    squares = {part: np.diag(whole) for part, whole in parts.items()}
    return {str(ErrorName.of(*error)): _largest(squares, rows, error) for error in p.foresight.errors}


def covariance_of(p: Prediction, starts: Starts, family: str) -> Parts:
    """(error, term) of the rows, part -> (R, R) of all terms when flights start, mean over the starts, SI."""
    at = (*starts.key, family)
    if at not in p.covariances:
        p.covariances[at] = _covariance(p, starts, family)
    return p.covariances[at]


def _covariance(p: Prediction, starts: Starts, family: str) -> Parts:
    f, rows = p.foresight, list[Row]()
    for error in f.errors:
        rows += [(error, t.name) for t in catalog.effects()[error[1]].terms(error[0])]
    asked = {}
    for error in f.errors:
        mine = [i for i, (owner, _) in enumerate(rows) if owner == error]
        asked[error] = np.zeros((len(rows), 1, len(mine)))
        asked[error][mine, 0, range(len(mine))] = 1.0
    begun = Foresight(f.unit, f.estimates, f.time[:1], f.day)
    parts = {part: np.zeros((len(rows), len(rows))) for part in PARTS}
    degc, shares = starts.grid(p.profile)
    for one, share in zip(degc, shares.tolist(), strict=True):
        seen, moments = begun.seen(asked, one[:1]), p.curves.moments(family)
        found = seen.without_curves()
        found["temperature"] += seen.curves(moments)
        found["estimate"] += seen.misread(moments)
        for part in PARTS:
            parts[part] += share * found[part]
    return rows, parts


def _largest(squares: Mapping[str, Array], rows: list[Row], error: tuple[str, str]) -> dict[str, float]:
    mine = [i for i, (owner, _) in enumerate(rows) if owner == error]
    most = max(mine, key=lambda i: sum(squares[part][i] for part in PARTS))
    return {part: float(np.sqrt(max(squares[part][most], 0.0))) for part in PARTS}


# ---------------------------------------------------------------- shares


def _check_shares(document: Document, p: Prediction) -> Findings:
    found = Findings("shares", "an error's part of the mean square is what it and the whole have in common")
    for i, (r, wanted) in enumerate(zip(document["requirements"], p.e.requirements, strict=False)):
        whole = shares_of(p, i, _starts(wanted, p.e.spec), _binding(document, p.e.spec, i))
        own = {error: share for error, share in whole.items() if error in document["allowances"]}
        said = {error: float(share) for error, share in r["shares"].items()}
        found.same(f"requirements {i}, shares", sorted(said), sorted(own))
        if sum(own.values()) <= (NOTHING * wanted.limit.si) ** 2:
            continue  # parts of nothing
        for error in sorted(said.keys() & own.keys()):
            share, counted = _part(said, error), _part(own, error)
            found.near(f"requirements {i}, shares, {error}", share, counted, SAME)
    return found


def _part(of: Mapping[str, float], error: str) -> float:
    total = sum(of.values())
    return of[error] / total if total > 0 else 0.0


def shares_of(p: Prediction, index: int, starts: Starts, family: str) -> dict[str, float]:
    """Error -> its part of the mean square of |d| at the last instant: E d_e · d, d = Σ d_e, SI²."""
    at = (index, *starts.key, family)
    if at not in p.shares:
        p.shares[at] = _shares(p, index, starts, family)
    return p.shares[at]


def _shares(p: Prediction, index: int, starts: Starts, family: str) -> dict[str, float]:
    f, n = p.foresight, p.asked[index]
    rows = len(n.beside) // n.instants
    degc, weights = starts.grid(p.profile)
    squares = np.zeros(len(f.errors))
    for one, weight in zip(degc, weights.tolist(), strict=True):
        seen, moments = f.seen(_one_by_one(n.at(one), f.errors, rows), one), p.curves.moments(family)
        whole = seen.rest + seen.curves(moments) + seen.misread(moments)
        across = whole[:-rows, -rows:].reshape(len(f.errors), rows, rows)
        squares += weight * np.trace(across, axis1=1, axis2=2)
    return {str(ErrorName.of(*error)): float(x) for error, x in zip(f.errors, squares, strict=True)}


def _one_by_one(asked: Asked, errors: Sequence[Error], rows: int) -> Asked:
    """What is asked of every error alone in its own rows, and of all together in the last: at the end."""
    found = {}
    for k, error in enumerate(errors):
        last = asked[error][-rows:]
        found[error] = np.zeros(((len(errors) + 1) * rows, *last.shape[1:]))
        found[error][k * rows : (k + 1) * rows] = found[error][-rows:] = last
    return found

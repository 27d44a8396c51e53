"""What is proved of a plan, what it rests on, what nobody has checked, where the formulas come from."""

from __future__ import annotations

import math

from planner.nouns.allowances import AllowedErrors
from planner.nouns.plan import Plan
from planner.nouns.sensitivities import Sensitivities
from planner.report.numbers import hours, level, percent
from planner.report.subjects.plan_tables import is_given

_ROUNDING = 1e-9  # of the gap: bounds differ by so much when they are equal
_RULES = {
    "worst_case": "the contributions of all errors and of all their parts add up in modulus (worst case), "
    "as if every error were at its limit with the worst sign at once",
    "rss": "contributions and parts add in squares (root of the sum of squares), as if all were independent",
    "percentile": "all parts are independent Gaussians and the percentile of the length of the error vector "
    "is computed exactly; parts add in squares",
}
_EARTH = "Earth: WGS-84. 1 g = 9.80665 m/s². K is A. A. Krylov, thesis, Moscow Aviation Institute, 2023."
_LINEAR = (
    "The navigation error is a linear combination of the sensor errors; products of two errors are left "
    "out (K 3.3 puts them near 1 % for flights of up to two hours)."
)
_PROMISED = {
    "rss": "the root mean square of the error over all flights",
    "percentile": "the size within which that share of all flights stays, by the exact distribution of the "
    "length of a Gaussian vector, or by draws of whole flights where the worst moment counts",
}
_FROM = {
    "range": "Flights start at any temperature of the range of use, each as likely as another",
    "worst": "Flights start at the temperature that is worst for the requirement",
    "flight": "Flights have the temperature of the spec's trajectory",
}


def is_hand_made(plan: Plan) -> bool:
    """Whether the spec left nothing to choose, so that the plan was only timed."""
    if plan.method == "information":  # one power-on has no half-width, so that there may be no reasons
        return plan.objective.startswith("nothing")
    return not math.isfinite(plan.gap) or all(r.bound_by == "fixed" for r in plan.reasons)


def proof(plan: Plan) -> tuple[str, ...]:
    """Proved optimal, within a gap, or timed only."""
    if plan.method == "information":
        return _proved_of(plan)
    return (_proof(plan),)


def _proved_of(plan: Plan) -> tuple[str, ...]:
    """How much shorter another campaign could be."""
    if is_hand_made(plan):
        return ("Made by hand: nothing was left to choose, its promise is foreseen.",)
    if plan.proved and plan.gap <= _ROUNDING:
        return (f"Proved the shortest (minimised: {plan.objective.replace('_', ' ')}).",)
    found = (
        f"The shortest found. Not proved: another could be shorter by up to {percent(plan.gap, 2)}, none "
        f"takes less than {hours(plan.bound_s)} h (minimised: {plan.objective.replace('_', ' ')})."
    )
    return (found,)


def proved_among(plan: Plan) -> tuple[str, ...]:
    """Of which campaigns that is said."""
    return () if is_hand_made(plan) or not plan.proved_of else (f"Among {plan.proved_of}.",)


def _proof(plan: Plan) -> str:
    if is_hand_made(plan):
        return "Hand-made plan: timed, nothing was left to optimise."
    if plan.proved and plan.gap <= _ROUNDING:
        return f"Proved: no campaign that meets the requirements does better (minimised: {plan.objective})."
    if plan.work_proved and not plan.proved:
        chosen = (
            "the shortest in total of those that were timed"
            if plan.by_total
            else "proved the best by working time, and none that was timed is shorter in total"
        )
        return (
            f"Temperatures and repeats: {chosen}. Their order: the best for this work. "
            f"No choice takes less than {hours(plan.bound_s)} h, waiting left out; what is above that, "
            f"{percent(plan.gap, 2)} of the total, is waiting or not proved (minimised: {plan.objective})."
        )
    return (
        f"Not proved: within {percent(plan.gap, 2)} of the best possible; "
        f"no campaign takes less than {hours(plan.bound_s)} h (minimised: {plan.objective})."
    )


def assumed(plan: Plan, sensitivities: Sensitivities | None, trajectory_name: str) -> tuple[str, ...]:
    """What was taken for granted in this plan."""
    if plan.method == "information":
        return (*_promised(plan), _sensitivity_source(plan, sensitivities, trajectory_name), _LINEAR)
    rules = dict.fromkeys(r.rule for r in plan.requirements)
    found = [f"Rule “{rule}”: {_RULES[_kind(rule)]}." for rule in rules if _kind(rule) in _RULES]
    found.append(_sensitivity_source(plan, sensitivities, trajectory_name))
    found.append(_LINEAR)
    found += _quantile_notes(plan)
    found.append(
        "Calibration removes the mean of an error, never its spread: every flight is a new power-on, so the "
        "run-to-run part stays in the budget."
    )
    found.append(
        "Spreads, in-run and storage parts and the temperature residual against the number of points are the "
        "spec's figures; the bench's own uncertainty is not part of the budget unless the spec says so."
    )
    return tuple(found)


def _promised(plan: Plan) -> list[str]:
    """What a promise of what will be flown takes for granted."""
    rules = dict.fromkeys(_kind(r.rule) for r in plan.requirements)
    found = [f"Rule “{rule}”: {_PROMISED[rule]}." for rule in rules if rule in _PROMISED]
    starts = dict.fromkeys(r.temperature for r in plan.requirements)
    found += [f"{_FROM.get(t, f'Flights start at {t}')}; the profile goes along with it." for t in starts]
    found += [
        "A record is one averaged reading: constants and tables of the sensor, the same for all records, the "
        "draw of its power-on, the drift since that began, and white noise. What the records leave of the "
        "coefficients is the covariance of weighted least squares over the whole campaign; a test counts "
        "for every error that its records tell.",
        "Each flight is a new power-on with draws of its own: run to run, in run, storage, white noise.",
        _TABLES[plan.temperature_estimator],
        f"Curves over temperature are random: {_curves(plan)}",
        "Spreads are the spec's figures, taken as known unless it says from how many power-ons they were "
        "estimated; references of the benches are exact unless it says how well they are known.",
    ]
    return found


_TABLES = {
    "lines": "Tables have the campaign's temperatures as nodes, with straight lines between, as “planner "
    "calibrate” makes them; what lines miss of a curve is in the promise.",
    "smooth": "Tables are smooth: the posterior mean of a curve from the campaign's temperatures, as "
    "“planner calibrate” makes it; its prior is the mean of the second moments of all families below, and "
    "what it misses of a curve is in the promise.",
}


def _curves(plan: Plan) -> str:
    if len(plan.families) == 1:
        return f"of the family {next(iter(plan.families))}, which the spec names."
    return (
        f"the promise holds for each of the families {', '.join(plan.families)}, which leave the same table."
    )


def not_verified(plan: Plan, allowed: AllowedErrors | None) -> tuple[str, ...]:
    """What this report does not show, and which command would."""
    found = [
        "No campaign, calibration or flight was simulated for this report: the promise itself is tested by "
        "“planner verify”.",
        "Durations are those of the spec; faults, operators' hours and repeated records are not included.",
    ]
    if is_hand_made(plan):
        found.append("The plan was made by hand; whether a shorter one would do was not asked.")
    elif not (plan.proved and plan.gap <= _ROUNDING):
        found.append("That no shorter campaign exists is not proved.")
    if plan.genetic is None and allowed is None:
        found.append("The genetic algorithm was not run, so nothing stands beside the exact answer.")
    if any(not r.met for r in plan.requirements):
        found.append("At least one requirement is not met by this plan.")
    return tuple(found)


def sources(plan: Plan) -> tuple[str, ...]:
    """Where the formulas come from. K is A. A. Krylov's thesis (MAI, Moscow, 2023)."""
    return _sources_of_promise() if plan.method == "information" else _published_sources()


def _sources_of_promise() -> tuple[str, ...]:
    return (
        "Linear combination of sensor errors: K 3.3 and 3.4, eqs 32–34.",
        "Information of records adds up; the best linear unbiased estimate and its covariance: Rao, Linear "
        "Statistical Inference and Its Applications, 2nd ed., 1973, chapter 4.",
        "Bound: no linear estimate of a curve is better than kriging from its exact values at the "
        "temperatures visited: Cressie, Statistics for Spatial Data, 1993, 3.2.",
        "Pareto set: NSGA-II, Deb et al., IEEE Transactions on Evolutionary Computation 6, 2002.",
        "Percentile of the length of a Gaussian vector: weighted chi-squares, Imhof, Biometrika 48 (1961).",
        "Residual against the number of temperature points: K table 2.10, unless the spec gives its own.",
        "Half-widths that stand beside: K 2.5.2, eq 27. Time of a campaign: K 2.6, eq 28, and 4.1.2, eq 35; "
        "ramps, moves, power cycles: the spec's benches.",
        _EARTH,
    )


def _published_sources() -> tuple[str, ...]:
    return (
        "Linear combination of sensor errors: K 3.3 and 3.4, eqs 32–34.",
        "Repeats from the confidence interval, n ≥ (t·s/d)²: K 2.5.2, eq 27. K prints t = 2.96 for 99 %; the "
        "normal value is 2.576. Student's t has n − 1 degrees of freedom.",
        "Residual against the number of temperature points: K table 2.10, unless the spec gives its own.",
        "Time of a campaign: K 2.6, eq 28, and 4.1.2, eq 35; ramps, moves, power cycles: the spec's benches.",
        "Genetic algorithm and its settings: K 3.4.3.",
        "Allowed region (rhombus) of two drifts: K figs 4.2–4.5; for other rules it follows from the rule.",
        "Percentile of the length of a Gaussian vector: weighted chi-squares, Imhof, Biometrika 48 (1961).",
        _EARTH,
    )


def _kind(rule: str) -> str:
    return "percentile" if rule.startswith("percentile") or "%" in rule else rule


def _sensitivity_source(plan: Plan, sensitivities: Sensitivities | None, trajectory_name: str) -> str:
    if is_given(plan, sensitivities):
        return (
            "Coefficients were given in the spec, all axes together, not simulated; nothing here checks them "
            "against a flight."
        )
    return f"Coefficients were simulated along “{trajectory_name}” with the linear error equations."


def _quantile_notes(plan: Plan) -> list[str]:
    kinds = dict.fromkeys((r.quantile_name, r.confidence) for r in plan.reasons)
    notes = []
    for name, confidence in kinds:
        text = f"Repeats use the {name} quantile at {level(confidence)} confidence"
        if name.startswith("normal"):
            text += ", which takes the spread for exactly known and is too small when repeats are few"
        else:
            text += ", for a spread that is estimated from the same repeats"
        notes.append(text + "; power-ons are independent and Gaussian.")
    return notes

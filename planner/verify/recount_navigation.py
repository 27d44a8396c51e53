"""The requirements counted again: sensitivities on the spec's flight, what the allowances make of them.

The columns are differences of flights through the nonlinear strapdown (recount_sensitivities), the planner's
come from linear error equations; NAVIGATED is how far the two may be apart. What follows from the plan's own
columns must follow to all digits: worst cases add moduli, rss adds squares. A percentile is found on the
distribution of the length itself (Imhof 1961), from the columns counted here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.nouns.trajectory import Trajectory
from planner.protocols import SENSORS
from planner.spec.model import NAVIGATION_ERRORS, Given, PercentileRule, Requirement, Spec
from planner.units import unit_factor
from planner.verify.along_flight import COMPONENTS, day_of
from planner.verify.findings import Document, Findings
from planner.verify.lengths import length_quantile
from planner.verify.recount_sensitivities import Slopes, slopes_of

Vectors = Mapping[str, Array]  # error -> (terms, k), SI
# The linear columns take an error as even over a sample and gravity's gradient over a block of a second: on
# the shipped flights position and velocity at the end differ by 5e-6 to 5e-4, angles in a turn by 4e-4.
NAVIGATED = 1e-3
LITTLE = 1e-4  # of the whole error: what a column less than this may add is not compared
KEPT = 1e-6  # of a limit: what a search by information may exceed it by
_EXACT = 1e-7  # of what follows from figures of twelve digits


def check_navigation(
    document: Document, spec: Spec, trajectory: Trajectory | None, by_information: bool = False
) -> list[Findings]:
    """Requirements, sensitivities and shares; of a plan by information what its flight alone says."""
    found = Findings("requirements", "limits are the spec's, what is achieved is what the allowances make")
    columns = Findings("sensitivities", "metres per unit of every error are those of the spec's flight")
    found.same("requirements", len(document["requirements"]), len(spec.requirement))
    history = _Columns(spec, trajectory)
    sure = _EXACT if isinstance(spec.sensitivities, Given) else NAVIGATED
    for i, (wanted, figures) in enumerate(zip(spec.requirement, document["requirements"], strict=False)):
        _check_words(found, i, wanted, figures)
        factor = unit_factor(NAVIGATION_ERRORS[wanted.error])[0]
        lengths, instants = _listed(document, i, factor), history.at(wanted)
        said, where = figures["achieved"] * factor, f"requirements {i}"
        if by_information:
            likest = min(instants, key=lambda v: _unlike(document, v, lengths))
            room = figures.get("spread_factor", document.get("spread_factor", 1.0))
            _check_met(found, where, figures, wanted, KEPT, room)
            _check_columns(columns, document, i, wanted, likest, said, sure)
            continue
        vectors, achieved = _achieved(document, wanted, instants, lengths)
        found.same(f"{where}, achieved", figures["achieved"], achieved / factor, sure)
        if not isinstance(wanted.rule, PercentileRule):
            found.same(f"{where}, achieved", said, _of_lengths(document, wanted, lengths), _EXACT)
        _check_met(found, where, figures, wanted, 1e-9)
        shares = _shares(document, wanted, lengths)
        found.same(f"{where}, shares", sorted(figures["shares"]), sorted(shares))
        for name, share in shares.items():
            found.same(f"{where}, shares, {name}", figures["shares"].get(name), share, _EXACT)
        _check_columns(columns, document, i, wanted, vectors, achieved, sure)
    return [found, columns]


def _check_met(
    found: Findings, where: str, figures: Document, wanted: Requirement, over: float, room: float = 1.0
) -> None:
    """What the plan's own figure says of the limit, which may be exceeded by so much; room: for spreads."""
    said = figures["achieved"] * room * unit_factor(NAVIGATION_ERRORS[wanted.error])[0]
    found.same(f"{where}, met", figures["met"], said <= wanted.limit.si * (1.0 + over))
    if not figures["met"]:
        found.fault(where, "is not met by the plan's own figures")


def _check_words(found: Findings, i: int, wanted: Requirement, figures: Document) -> None:
    at = wanted.at if isinstance(wanted.at, str) else f"{wanted.at:g} s"
    rule = wanted.rule
    said = f"percentile {100 * rule.percentile:g} %" if isinstance(rule, PercentileRule) else rule
    unit = NAVIGATION_ERRORS[wanted.error]
    for key, value in (
        ("error", wanted.error),
        ("at", at),
        ("rule", said),
        ("unit", unit),
        ("limit", wanted.limit.si / unit_factor(unit)[0]),
    ):
        found.same(f"requirements {i}, {key}", figures[key], value)


class _Columns:
    """Vectors of every error at the instants of a requirement."""

    def __init__(self, spec: Spec, trajectory: Trajectory | None) -> None:
        self.spec = spec
        self.errors = [(sensor, effect) for sensor in SENSORS for effect in getattr(spec.unit, sensor)]
        self.slopes: Slopes | None = None
        if not isinstance(spec.sensitivities, Given) and trajectory is not None:
            flown = replace(trajectory, day=day_of(trajectory, spec))  # of a campaign that takes no time
            self.slopes = slopes_of(flown, self.errors, _instants(flown, spec.requirement))

    def at(self, wanted: Requirement) -> list[Vectors]:
        """The vectors at every instant at which it holds."""
        if isinstance(self.spec.sensitivities, Given):
            given = self.spec.sensitivities.given
            return [{name: np.array([[quantity.si]]) for name, quantity in given.items()}]
        assert self.slopes is not None
        field, components = COMPONENTS[wanted.error]
        values: Array = getattr(self.slopes, field)[:, components]
        if wanted.at == "any":
            return [self._named(v) for v in values]
        when = self.slopes.time_s[-1] if wanted.at == "end" else float(wanted.at)
        return [self._named(values[int(np.argmin(np.abs(self.slopes.time_s - when)))])]

    def _named(self, components: Array) -> Vectors:
        found: dict[str, Array] = {}
        first = 0
        for sensor, effect in self.errors:
            count = len(catalog.effects()[effect].terms(sensor))
            found[ErrorName.of(sensor, effect)] = components[:, first : first + count].T
            first += count
        return found


def _instants(trajectory: Trajectory, requirements: Sequence[Requirement]) -> Array:
    """(m,) s: the end, the times asked for; for any moment every second, and sixty moments at least."""
    t = trajectory.time_s - trajectory.time_s[0]
    step, end = float(t[1]), float(t[-1])
    found = [end, *(float(r.at) for r in requirements if not isinstance(r.at, str))]
    if any(r.at == "any" for r in requirements):
        every = max(1, round(min(1.0, end / 60.0) / step))
        found += t[every::every].tolist()
    return np.asarray(np.unique(np.rint(np.array(found) / step)) * step + trajectory.time_s[0])


def _listed(document: Document, i: int, factor: float) -> dict[str, Array]:
    """Error -> lengths (terms,) as the plan lists them for requirement i, SI."""
    found: dict[str, Array] = {}
    for name, a in document["allowances"].items():
        per = unit_factor(a["unit"])[0] / factor
        rows = [s for s in document["sensitivities"] if s["requirement"] == i and s["error"] == name]
        found[name] = np.array([float(s["value"]) for s in rows]) / per
    return found


def _achieved(
    document: Document, wanted: Requirement, instants: Sequence[Vectors], lengths: Mapping[str, Array]
) -> tuple[Vectors, float]:
    """The instant at which most of the limit is used, and how much, SI.

    Of instants that are as good as equal the one whose columns are most like the plan's.
    """
    likely = _likely(document, wanted, instants)
    values = np.array([_combined(document, wanted, vectors) for vectors in likely])
    most = float(values.max())
    equal = np.flatnonzero(values >= most * (1.0 - NAVIGATED))
    return min((likely[int(k)] for k in equal), key=lambda v: _unlike(document, v, lengths)), most


def _unlike(document: Document, vectors: Vectors, lengths: Mapping[str, Array]) -> float:
    """Sum of squares of differences of the columns' lengths, each times its error's size."""
    total = 0.0
    for name, said in lengths.items():
        own = _lengths_of(vectors, name)
        if len(own) == len(said):
            total += float(np.sum((own - said) ** 2)) * _size(document, name, False) ** 2
    return total


def _lengths_of(vectors: Vectors, name: str) -> Array:
    """(terms,) of an error's columns; none of an error that does not fly."""
    return np.linalg.norm(vectors[name], axis=1) if name in vectors else np.zeros(0)


def _likely(document: Document, wanted: Requirement, instants: Sequence[Vectors]) -> Sequence[Vectors]:
    """For a percentile at any moment: the dozen instants of largest variance, for each costs an integral."""
    if not isinstance(wanted.rule, PercentileRule) or len(instants) <= 12:
        return instants
    traces = [float(np.trace(_covariance(document, v))) for v in instants]
    return [instants[i] for i in sorted(np.argsort(traces)[-12:])]


def _size(document: Document, name: str, adds: bool) -> float:
    """SI size of an error by the rule of a requirement, from its parts."""
    a = document["allowances"].get(name)
    if a is None:
        return 0.0
    parts = np.array(list(a["parts"].values())) * unit_factor(a["unit"])[0]
    return float(parts.sum() if adds else np.sqrt((parts**2).sum()))


def _combined(document: Document, wanted: Requirement, vectors: Vectors) -> float:
    if isinstance(wanted.rule, PercentileRule):
        return length_quantile(_covariance(document, vectors), wanted.rule.percentile)
    adds = wanted.rule == "worst_case"
    terms = [np.linalg.norm(v, axis=1) * _size(document, name, adds) for name, v in vectors.items()]
    every = np.concatenate(terms) if terms else np.zeros(1)
    return float(every.sum() if adds else np.sqrt((every**2).sum()))


def _covariance(document: Document, vectors: Vectors) -> Array:
    k = next(iter(vectors.values())).shape[1]
    total = np.zeros((k, k))
    for name, v in vectors.items():
        total += _size(document, name, False) ** 2 * v.T @ v
    return total


def _of_lengths(document: Document, wanted: Requirement, lengths: Mapping[str, Array]) -> float:
    """What a sum of moduli or of squares makes of the plan's own columns, SI."""
    adds = wanted.rule == "worst_case"
    every = np.concatenate([n * _size(document, name, adds) for name, n in lengths.items()] or [np.zeros(1)])
    return float(np.abs(every).sum() if adds else np.sqrt((every**2).sum()))


def _shares(document: Document, wanted: Requirement, lengths: Mapping[str, Array]) -> dict[str, float]:
    adds = wanted.rule == "worst_case"
    parts = {}
    for name, own in lengths.items():
        each = np.abs(own) * _size(document, name, adds)
        parts[name] = float(each.sum() if adds else (each**2).sum())
    total = sum(parts.values())
    return {name: (value / total if total > 0 else 0.0) for name, value in parts.items()}


def _check_columns(
    found: Findings,
    document: Document,
    i: int,
    wanted: Requirement,
    vectors: Vectors,
    achieved: float,
    sure: float,
) -> None:
    """One coefficient for every term: length per display unit."""
    unit = NAVIGATION_ERRORS[wanted.error]
    expected = []
    for name, a in document["allowances"].items():
        sensor, effect = ErrorName(name).parts
        lengths = _lengths_of(vectors, name)
        terms = [t.name for t in catalog.effects()[effect].terms(sensor)]
        axes = terms if len(terms) == len(lengths) else ["all"] * len(lengths)
        per = unit_factor(a["unit"])[0] / unit_factor(unit)[0]
        shown = unit if a["unit"] == "1" else f"{unit}/({a['unit']})"
        size = _size(document, name, wanted.rule == "worst_case") / unit_factor(a["unit"])[0]
        little = LITTLE * achieved / unit_factor(unit)[0] / size if size > 0 and sure == NAVIGATED else 0.0
        expected += [
            (name, axis, float(length) * per, shown, little)
            for axis, length in zip(axes, lengths, strict=True)
        ]
    mine = [s for s in document["sensitivities"] if s["requirement"] == i]
    found.same(f"sensitivities of requirement {i}", len(mine), len(expected))
    for s, (name, axis, value, shown, little) in zip(mine, expected, strict=False):
        where = f"sensitivities of requirement {i}, {name} {axis}"
        found.same(where, [s["error"], s["axis"], s["unit"]], [name, axis, shown])
        if s["value"] < 0 or abs(s["value"] - value) > little:
            found.same(f"{where}, value", s["value"], value, sure)

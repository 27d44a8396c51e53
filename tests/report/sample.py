"""A made-up but consistent campaign to draw: two benches, seven temperatures, both sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from planner.nouns.allowances import Allowance, AllowedErrors, Corner, GeneticHistory
from planner.nouns.array import Rule
from planner.nouns.choices import RepeatReason
from planner.nouns.plan import Achieved, GeneticPlan, Plan, PlannedTest, Price, SensitivityFigure, Worth
from planner.nouns.sensitivities import Constraint, Sensitivities, SensitivityColumn
from planner.nouns.step import Step
from planner.units import unit_factor

UNITS = {
    "gyro.bias": "deg/s",
    "gyro.scale_factor": "%",
    "accelerometer.bias": "g",
    "accelerometer.scale_factor": "%",
    "gyro.misalignment": "deg",
}
# run-to-run, in-run, storage, temperature, estimate in display units
PARTS = {
    "gyro.bias": (0.002, 0.001, 0.001, 0.0035, 0.0012),
    "gyro.scale_factor": (0.002, 0.002, 0.002, 0.0058, 0.0007),
    "accelerometer.bias": (0.0010, 0.0005, 0.001, 0.0022, 0.0006),
    "accelerometer.scale_factor": (0.002, 0.002, 0.002, 0.0052, 0.0009),
    "gyro.misalignment": (0.001, 0.0, 0.001, 0.002, 0.0006),
}
SENSITIVITY = {  # metres per display unit, along one axis, at the end of the flight
    "gyro.bias": 300.0,
    "gyro.scale_factor": 30.0,
    "accelerometer.bias": 900.0,
    "accelerometer.scale_factor": 60.0,
    "gyro.misalignment": 80.0,
}
TEMPERATURES = (-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0)


class Clock:
    """Appends steps one after another."""

    def __init__(self) -> None:
        self.now = 0.0
        self.steps: list[Step] = []

    def add(self, bench: str, action: str, seconds: float, **rest: object) -> None:
        label = "/".join(
            str(x) for x in (bench, rest.get("temperature_degc"), rest.get("test"), len(self.steps))
        )
        self.steps.append(Step(label, bench, action, self.now, self.now + seconds, units=4, **rest))
        self.now += seconds


def _repeat(
    clock: Clock, bench: str, test: str, degc: float, repeat: int, motions: int, record: float, gap: float
) -> None:
    where: dict[str, object] = {"test": test, "temperature_degc": degc, "repeat": repeat}
    clock.add(bench, "power_on", 60.0, **where)
    for motion in range(motions):
        clock.add(bench, "move", 5.0, **where, motion={"rate_1_dps": 10.0 * motion})
        clock.add(bench, "record", record, **where, motion={"rate_1_dps": 10.0 * motion})
    clock.add(bench, "cool_down", gap, **where)
    clock.add(bench, "power_off", 2.0, **where)


def _rate_table(clock: Clock, repeats: int) -> None:
    clock.add("rate_table", "install", 1800.0, temperature_degc=20.0)
    previous = 20.0
    for degc in sorted(TEMPERATURES, reverse=True):
        clock.add("rate_table", "ramp", abs(degc - previous) * 30.0, temperature_degc=degc)
        clock.add("rate_table", "soak", 1800.0, temperature_degc=degc)
        for repeat in range(1, repeats + 1):
            _repeat(clock, "rate_table", "static", degc, repeat, 1, 300.0, 900.0)
        if degc in TEMPERATURES[::3]:
            for repeat in range(1, repeats + 3):
                _repeat(clock, "rate_table", "rates", degc, repeat, 12, 20.0, 60.0)
        previous = degc
    clock.add("rate_table", "remove", 900.0, temperature_degc=previous)


def _centrifuge(clock: Clock) -> None:
    clock.add("centrifuge", "install", 1800.0, temperature_degc=20.0)
    for repeat in range(1, 6):
        _repeat(clock, "centrifuge", "loads", 20.0, repeat, 6, 30.0, 120.0)


def _steps(repeats: int) -> tuple[Step, ...]:
    clock = Clock()
    _rate_table(clock, repeats)
    _centrifuge(clock)
    return tuple(clock.steps)


def _spent(steps: tuple[Step, ...], test: str) -> float:
    return sum(s.end_s - s.start_s for s in steps if s.test == test)


def _tests(steps: tuple[Step, ...], repeats: int) -> tuple[PlannedTest, ...]:
    few = TEMPERATURES[::3]
    rows = (
        ("static", "rate_table", TEMPERATURES, repeats, ("gyro.bias", "accelerometer.bias"), 1),
        ("rates", "rate_table", few, repeats + 2, ("gyro.scale_factor", "gyro.misalignment"), 12),
        ("loads", "centrifuge", (20.0,), 5, ("accelerometer.scale_factor",), 6),
    )
    return tuple(
        PlannedTest(
            name, bench, degc, (n,) * len(degc), _spent(steps, name), _spent(steps, name) * 0.3, errors, m
        )
        for name, bench, degc, n, errors, m in rows
    )


def _allowances(rule: str) -> tuple[Allowance, ...]:
    found = []
    for error, parts in PARTS.items():
        si = [p * unit_factor(UNITS[error])[0] for p in parts]
        allowed = sum(si) if rule == "worst_case" else math.sqrt(sum(p * p for p in si))
        found.append(Allowance(error, UNITS[error], allowed, *si))
    return tuple(found)


def vectors() -> dict[str, np.ndarray]:
    """Three axes an error, north-east-up, per SI unit."""
    directions = np.array([[0.9, 0.1, 0.42], [0.2, 0.95, 0.24], [0.1, 0.3, 0.95]])
    return {e: directions * SENSITIVITY[e] / unit_factor(UNITS[e])[0] for e in SENSITIVITY}


def constraints(rule: Rule = "worst_case", limit: float = 30.0) -> tuple[Constraint, ...]:
    percentile = 0.95 if rule == "percentile" else None
    return (Constraint(0, "position", "m", rule, limit, 60.0, vectors(), percentile),)


def _achieved(rule: Rule, limit: float, allowances: tuple[Allowance, ...]) -> Achieved:
    lengths = {e: np.linalg.norm(v, axis=1) for e, v in vectors().items()}
    if rule == "worst_case":
        shares = {a.error: float(lengths[a.error].sum() * a.allowed) for a in allowances}
        value = sum(shares.values())
    else:
        shares = {a.error: float((lengths[a.error] ** 2).sum() * a.allowed**2) for a in allowances}
        value = math.sqrt(sum(shares.values()))
    shown = "percentile 95 %" if rule == "percentile" else rule
    return Achieved("position", "end", shown, "m", limit, value, value <= limit, shares)


def _reasons(repeats: int) -> tuple[RepeatReason, ...]:
    rows = []
    for error, test, degcs in (
        ("gyro.bias", "static", TEMPERATURES),
        ("accelerometer.bias", "static", TEMPERATURES),
        ("gyro.scale_factor", "rates", TEMPERATURES[::3]),
        ("accelerometer.scale_factor", "loads", (20.0,)),
    ):
        factor = unit_factor(UNITS[error])[0]
        for i, degc in enumerate(degcs):
            spread, d = PARTS[error][0] * factor * (1 + 0.1 * (i % 3)), PARTS[error][4] * factor
            bound = ("accuracy", "shared", "least", "fixed")[len(rows) % 4]
            rows.append(
                RepeatReason(
                    error,
                    test,
                    degc,
                    spread,
                    0.95,
                    "student",
                    2.57,
                    repeats,
                    d * 0.93,
                    d,
                    bound,
                )
            )
    return tuple(rows)


def history(generations: int = 120, end: float = 1e-9) -> GeneticHistory:
    best = tuple((3.0 + end) * 0.9**i + end for i in range(generations))
    mean = tuple((9.0 + 2 * end) * 0.95**i + 0.4 + 1.2 * end for i in range(generations))
    return GeneticHistory(best, mean, generations, generations * 256, "converged")


def _front(allowances: tuple[Allowance, ...], count: int) -> list[dict[str, float]]:
    rng = np.random.default_rng(4)
    spread = rng.dirichlet(np.ones(len(allowances)), count) * len(allowances)
    return [
        {a.error: float(a.allowed * (0.4 + 0.6 * s)) for a, s in zip(allowances, row, strict=True)}
        for row in spread
    ]


def genetic(allowances: tuple[Allowance, ...], time_s: float) -> GeneticPlan:
    front = _front(allowances, 32)
    rows: list[Mapping[str, float]] = [
        {**row, "time_s": time_s * (1 + 0.02 * i)} for i, row in enumerate(front)
    ]
    return GeneticPlan(time_s * 1.004, 0.004, history(end=time_s * 1.004), tuple(rows))


def allowed(allowances: tuple[Allowance, ...]) -> AllowedErrors:
    corners = tuple(
        Corner(
            a.error,
            {b.error: b.allowed * (1.395 if b is a else 0.9) for b in allowances},
            {b.error: b.allowed * (1.4 if b is a else 0.9) for b in allowances},
            0.0036,
        )
        for a in allowances
    )
    return AllowedErrors(
        tuple(a.error for a in allowances),
        {a.error: a.unit for a in allowances},
        {a.error: a.allowed * 0.6 for a in allowances},
        {a.error: a.allowed * 6 for a in allowances},
        tuple(tuple(row.values()) for row in _front(allowances, 60)),
        corners,
        history(200),
        {0: 0.62},
    )


def sensitivities(instants: int = 121) -> Sensitivities:
    """Grows with t^3 for gyros and t^2 for accelerometers, as double integration does."""
    time = np.linspace(0.0, 60.0, instants)
    columns, blocks = [], []
    for error, per_axis in vectors().items():
        power = 3 if error.startswith("gyro") else 2
        for axis, vector in zip("xyz", per_axis, strict=True):
            columns.append(SensitivityColumn(error, axis, UNITS[error]))
            blocks.append((time / 60.0)[:, None] ** power * vector)
    position = np.stack(blocks, axis=2)
    return Sensitivities(time, tuple(columns), position, position / 30.0, position * 1e-5)


def given_sensitivities() -> Sensitivities:
    """Published coefficients: one instant, one column an error."""
    columns = tuple(SensitivityColumn(e, "all", UNITS[e]) for e in SENSITIVITY)
    values = np.array([SENSITIVITY[e] / unit_factor(UNITS[e])[0] for e in SENSITIVITY])
    position = np.zeros((1, 3, len(columns)))
    position[0, 0] = values
    return Sensitivities(
        np.array([60.0]), columns, position, np.zeros_like(position), np.zeros_like(position)
    )


def plan(
    rule: Rule = "worst_case", *, repeats: int = 8, limit: float = 30.0, name: str = "small UAV, one minute"
) -> Plan:
    steps = _steps(repeats)
    allowances = _allowances(rule)
    end = steps[-1].end_s
    return Plan(
        version="0.1.0",
        name=name,
        spec_sha256="9f" * 32,
        seed=1,
        objective="time",
        requirements=(_achieved(rule, limit, allowances),),
        sensitivities=tuple(
            SensitivityFigure(e, axis, SENSITIVITY[e], f"m/({UNITS[e]})", 0)
            for e in SENSITIVITY
            for axis in "xyz"
        ),
        allowances=allowances,
        tests=_tests(steps, repeats),
        steps=steps,
        reasons=_reasons(repeats),
        time_s=end,
        bound_s=end,
        gap=0.0,
        power_on_s=end * 0.35,
        objective_value=end,
        hours_per_limit={0: 3.2},
        genetic=genetic(allowances, end),
        notes=("The residual of gyro.bias at 7 points is taken from the table, not interpolated.",),
        objective_bound=end,
    )


def fixed_plan() -> Plan:
    """A hand-made plan that misses its limit: no genetic algorithm, no proof, no price of the limit."""
    base = plan(limit=20.0)
    reasons = tuple(replace(r, bound_by="fixed") for r in base.reasons)
    return replace(base, genetic=None, hours_per_limit={}, notes=(), reasons=reasons)


def huge_plan(count: int = 100_000) -> Plan:
    """As many steps as a year of short records."""
    base = plan()
    clock = Clock()
    for i in range(count):
        action = ("move", "record", "pause")[i % 3]
        degc = TEMPERATURES[(i * len(TEMPERATURES)) // count]
        clock.add(
            ("rate_table", "centrifuge")[i % 2], action, 20.0 + i % 7, test="static", temperature_degc=degc
        )
    return replace(base, steps=tuple(clock.steps), time_s=clock.now, bound_s=clock.now)


def informed_plan() -> Plan:
    """A plan by information with two requirements, under two families of curves; each binds one of them."""
    base = plan("percentile")
    first = replace(base.requirements[0], family="kink", temperature="range")
    second = replace(
        first, error="horizontal", at="any", limit=20.0, achieved=18.0, family="cosines", temperature="worst"
    )
    rows: list[Mapping[str, float]] = [
        {"time_s": base.time_s * (0.7 + 0.1 * i), "power_on_s": 3600.0 * i, "0": 60.0 / (1 + i), "1": 30.0}
        for i in range(8)
    ]
    visits = (Worth("static", -20.0, 2, 3600.0, 1200.0, (math.inf, 40.0), (27.0, 18.5), (25.0, 17.5)),)
    return replace(
        base,
        method="information",
        objective="campaign_time",
        requirements=(first, second),
        families={"cosines": {0: 20.0, 1: 18.0}, "kink": {0: first.achieved, 1: 15.0}},
        proved=False,
        bound_s=0.8 * base.time_s,
        gap=0.2,
        proved_of="campaigns of static and rates at 25 temperatures",
        reasons=tuple(replace(r, bound_by="promise") for r in base.reasons),
        genetic=GeneticPlan(base.time_s * 1.02, 0.02, history(24, base.time_s), tuple(rows)),
        worth=visits,
        prices=(Price("soak 10 min less", -600.0), Price("limits 1 % wider", -1e-7)),
        notes=(),
    )

"""What campaigns tell, many at once, against the campaign model one by one and against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from planner.campaign.design import design
from planner.campaign.model import ChannelCampaign
from planner.campaign.power_ons import of_design
from planner.information.choose import laid_out
from planner.information.curves import Curves
from planner.information.kinds import ChannelKinds, campaign_of, kinds_of
from planner.information.model_of import Flight
from planner.information.offers import offers_of
from planner.information.told import Alike, Told, alike, told
from planner.nouns.array import Array
from planner.nouns.choices import Campaign as Choice
from planner.plan.schedule_to_steps import steps
from planner.solvers.least_squares import factors
from tests import oracle
from tests.campaign import campaigns
from tests.information import cases
from tests.information.cases import Everything
from tests.specs import SHIPPED, loaded

SEEDS = (0, 2, 4, 5, 9)  # one to three tests, in the chamber and in the room, one bench and two


def drawn(every: Everything, count: int, seed: int) -> Array:
    """(count, g) campaigns of a case that tell all that flies."""
    counts = every.counts()
    counts = counts[np.all(np.isfinite(every.quick(counts)), axis=1)]
    return counts[np.random.default_rng(seed).choice(len(counts), min(count, len(counts)), replace=False)]


def laid(flight: Flight, every: Everything, n: Array) -> dict[tuple[str, int], ChannelCampaign]:
    """The campaign model of the steps; all on one day, as `told` is without days."""
    runs = of_design(design(laid_out(flight, every.offers.visits(n)), flight.spec), flight.spec)
    runs.conditions.day[:] = 0.0
    return {(s, k): c for (s, k), c in campaign_of(flight.spec, runs, flight.curves).channels.items()}


def each(every: Everything, counts: Array) -> list[tuple[Alike, Told]]:
    """What is told of every group of channels."""
    groups = alike(every.promise.kinds.channels, every.promise.kinds.degc)
    return [(group, told(group, counts)) for group in groups]


def own(one: Told, b: int) -> list[int]:
    """The columns of one campaign's own coefficients: what others have more nodes for is left out."""
    sizes = [1 if nodes is None else int(np.isfinite(nodes[b]).sum()) for nodes in one.nodes]
    return [p.start + i for p, size in zip(one.places, sizes, strict=True) for i in range(size)]


def of_channel(group: Alike, c: ChannelKinds) -> int:
    return next(i for i, one in enumerate(group.channels) if one is c)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_covariance_is_the_campaign_models(seed: int) -> None:
    """The same sigma in plan and calibrate: of every coefficient, and of all products between them."""
    flight = cases.flight(cases.tree(seed))
    every = Everything(flight)
    counts = drawn(every, 3, seed)
    looked_at = 0
    for group, one in each(every, counts):
        for b, n in enumerate(counts):
            made, mine = laid(flight, every, n), own(one, b)
            for c in group.channels:
                known = campaigns.known(made[c.sensor, c.channel])
                found = one.covariance[of_channel(group, c), b][np.ix_(mine, mine)]
                assert np.isfinite(known.sigma).all()
                assert not one.undetermined[of_channel(group, c), b].any()
                assert len(mine) == len(known.columns)
                scale = np.sqrt(np.outer(known.sigma, known.sigma))
                np.testing.assert_allclose(found / scale, known.covariance / scale, atol=2e-7)
                looked_at += 1
    assert looked_at == 6 * len(counts)


@pytest.mark.parametrize("seed", [0, 4])  # in both records at rest alone, here on one face
def test_what_is_not_declared_leads_astray_as_its_size_says(seed: int) -> None:
    """The campaign model's covariance, in which it is an unknown, is `covariance` + Σ s² g gᵀ, g by `gains`.

    Left whole, `covariance` would count it twice: here it is a tenth of some variance at least.
    """
    tree = cases.tree(seed)
    tree["unit"]["gyro"] = tree["unit"]["gyro"] | {"g_sensitivity": {"systematic": "0.05 deg/s/g"}}
    tree["tests"] |= {name: t | {"motions": 1} for name, t in tree["tests"].items()}
    flight = cases.flight(tree)
    every, most = Everything(flight), 0.0
    counts = drawn(every, 2, seed)
    for group, one in each(every, counts):
        b_terms = len(group.first.terms)
        for b, n in enumerate(counts):
            made, mine = laid(flight, every, n), own(one, b)
            for a, c in enumerate(group.channels):
                wanted = campaigns.known(made[c.sensor, c.channel])
                scale = np.sqrt(np.outer(wanted.sigma, wanted.sigma))
                whole = one.whole[a, b][np.ix_(mine, mine)]
                np.testing.assert_allclose(whole / scale, wanted.covariance / scale, atol=2e-6)
                parts = one.covariance[a, b][np.ix_(mine, mine)].copy()
                for u, term in enumerate(c.unfitted):
                    size = getattr(flight.spec.unit, c.sensor)[term.error.effect].systematic_size
                    g = one.gains[b_terms + u][a, b, mine].sum(axis=1)
                    parts += size**2 / 3.0 * np.outer(g, g)
                np.testing.assert_allclose(parts / scale, wanted.covariance / scale, atol=2e-6)
                scatter = np.diag(one.covariance[a, b][np.ix_(mine, mine)])
                most = max(most, float(np.max(1.0 - scatter / np.diag(wanted.covariance))))
    assert most > 0.1


@pytest.mark.parametrize("seed", SEEDS[:4])
def test_the_covariance_is_dense_algebras(seed: int) -> None:
    """Against tests.oracle with a constant at every node: (AᵀV⁻¹A)⁻¹, records one by one."""
    flight = cases.flight(cases.tree(seed))
    spec, every = flight.spec, Everything(flight)
    counts = drawn(every, 2, seed + 1)
    for group, one in each(every, counts):
        for b, n in enumerate(counts):
            runs, mine = of_design(design(laid_out(flight, every.offers.visits(n)), spec), spec), own(one, b)
            for a, c in enumerate(group.channels):
                budgets = getattr(spec.unit, c.sensor)
                names = dict.fromkeys(t.error.effect for t in c.terms)
                sizes = {
                    e: oracle.size_of(budgets[e], storage=0.0) if e in budgets else oracle.Size()
                    for e in names
                }
                run = np.repeat(np.arange(len(runs.starts)), runs.sizes)
                slopes = flight.curves.slopes(runs.conditions.temperature_degc)
                mine_only = {e.effect: slope for e, slope in slopes.items() if e.sensor == c.sensor}
                strayed = oracle.strayed(c.sensor, runs.conditions, mine_only)
                white = np.hypot(spec.unit.white(c.sensor) / np.sqrt(runs.duration)[:, None], strayed)
                V = oracle.covariance(c.sensor, runs.conditions, run, sizes, white)[
                    c.channel :: 3, c.channel :: 3
                ]
                A = _columns(c, one, b, runs.conditions)
                wanted = np.linalg.inv(A.T @ np.linalg.solve(V, A))
                sigma = np.sqrt(np.diag(wanted))
                found = one.covariance[a, b][np.ix_(mine, mine)]
                np.testing.assert_allclose(
                    found / np.outer(sigma, sigma), wanted / np.outer(sigma, sigma), atol=1e-6
                )


def _columns(c: ChannelKinds, one: Told, b: int, conditions: oracle.Conditions) -> Array:
    """(n, P) the effects' regressors times hats by `interp`."""
    found = []
    for term, nodes in zip(c.terms, one.nodes, strict=True):
        effect = oracle.catalog.effects()[term.error.effect]
        place = [t.name for t in effect.terms(c.sensor)].index(term.name)
        x = effect.regressors(c.sensor, conditions)[:, c.channel, place]
        if nodes is None:
            found.append(x)
            continue
        degc = nodes[b][np.isfinite(nodes[b])]
        found += [x * np.interp(conditions.temperature_degc, degc, row) for row in np.eye(len(degc))]
    return np.stack(found, axis=1)


@pytest.mark.parametrize("seed", SEEDS[:5])
def test_gains_are_the_fits_answer_to_a_curve(seed: int) -> None:
    """Readings without noise that hold one curve: the weighted fit answers by the gains."""
    flight = cases.flight(cases.tree(seed))
    every = Everything(flight)
    counts = drawn(every, 3, seed + 2)
    rng = np.random.default_rng(seed)
    for group, one in each(every, counts):
        for b, n in enumerate(counts):
            made, mine = laid(flight, every, n), own(one, b)
            for i in (i for i, t in enumerate(group.first.terms) if t.tabled):
                for a, c in enumerate(group.channels):
                    curve = dict(zip(every.promise.kinds.degc.tolist(), rng.normal(size=99), strict=False))
                    model = made[c.sensor, c.channel]
                    t = model.runs.conditions.temperature_degc
                    x = _term(c, i, model)
                    y = x * np.array([curve[float(v)] for v in t])
                    answer = _answer(model, y)
                    found = one.gains[i][a, b] @ np.array([curve[float(v)] for v in group.degc[one.kinds[b]]])
                    size = np.abs(answer).max()
                    np.testing.assert_allclose(found[mine], answer[: len(mine)], atol=1e-6 * size)


def _term(c: ChannelKinds, i: int, model: ChannelCampaign) -> Array:
    term = c.terms[i]
    effect = oracle.catalog.effects()[term.error.effect]
    place = [t.name for t in effect.terms(c.sensor)].index(term.name)
    return effect.regressors(c.sensor, model.runs.conditions)[:, c.channel, place]


def _answer(model: ChannelCampaign, y: Array) -> Array:
    """(p,) least squares of white rows, one for every record."""
    rows = model.rows()
    found = factors(rows, 1e-9)
    repeats = np.sqrt(np.repeat(model.runs.counts, model.runs.sizes))
    white = np.concatenate([repeats * model.whiten(y[:, None])[:, 0], np.zeros(len(rows) - len(y))])
    return np.linalg.lstsq(rows, white, rcond=None)[0] if found is not None else np.zeros(0)


def test_information_of_a_union_is_the_sum() -> None:
    every = Everything(cases.flight(cases.tree(SEEDS[0])))
    rng = np.random.default_rng(0)
    n = rng.integers(1, 3, (2, len(every.offers.kinds))).astype(float)
    for (_group, both), (_, one), (_, other) in zip(
        each(every, n.sum(axis=0)[None]), each(every, n[:1]), each(every, n[1:]), strict=True
    ):
        P = both.undetermined.shape[2]
        inverse = [np.linalg.inv(x.covariance[:, 0, :P, :P]) for x in (both, one, other)]
        size = np.abs(inverse[0]).max()
        np.testing.assert_allclose(inverse[0] / size, (inverse[1] + inverse[2]) / size, atol=1e-7)


@pytest.mark.parametrize("seed", SEEDS[:4])
def test_a_record_more_never_makes_the_posterior_larger(seed: int) -> None:
    """At the temperatures of the campaign; a node more is another table."""
    every = Everything(cases.flight(cases.tree(seed)))
    counts = drawn(every, 5, seed)
    used = counts > 0
    more = counts + used * np.random.default_rng(seed).integers(0, 2, counts.shape)
    before, after = (
        {(id(g.first), b): one.covariance[:, b] for g, one in each(every, n) for b in range(len(n))}
        for n in (counts, more)
    )
    assert len(before) == len(after) == len(counts) * len({g for g, _ in before})
    for key, covariance in before.items():
        grown = np.linalg.eigvalsh(after[key] - covariance).max()
        assert grown <= 1e-9 * np.abs(covariance).max()


@pytest.mark.parametrize(
    ("used", "apart"), [("rates rates-slow", 8.0), ("static rates-slow", 8.0), ("static rates-slow", 1.0)]
)
def test_tables_are_those_of_the_campaign_itself(used: str, apart: float) -> None:
    """Nodes of every table as the fit of the campaign places them, whatever else is on offer.

    Turns of two tables hardly press on accelerometers, and unequally: the slower one shows a scale factor
    beside six faces, the faster one only without them. Unused temperatures keep none apart.
    """
    tree = yaml.safe_load((SHIPPED / "small_uav.yaml").read_text())
    tree["benches"]["slow"] = {
        **tree["benches"]["rate_table"], "kind": "rate_table", "limits": {"rate": "300 deg/s"}
    }  # fmt: skip
    tree["tests"]["rates"]["bench"] = ["rate_table", "slow"]
    spec = loaded(tree).spec
    curves = Curves(spec)
    at = [(test, (-30.0, 10.0 + i * apart, 40.0)) for i, test in enumerate(spec.tests)]
    kinds = kinds_of(spec, at, curves)
    offers = offers_of(spec, kinds.kinds)
    n = np.array([2.0 if k.test in used.split() else 0.0 for k in kinds.kinds])
    runs = of_design(design(steps(spec, Choice(offers.visits(n), (), 0.0, 0.0, False)), spec), spec)
    made = campaign_of(spec, runs, curves).channels
    for group in alike(kinds.channels, kinds.degc):
        one = told(group, n[None])
        for c in group.channels:
            assert [None if x is None else x[0].tolist() for x in one.nodes] == [
                None if x.nodes is None else x.nodes.tolist() for x in made[c.sensor, c.channel].model.carried
                for _ in x.terms
            ]  # fmt: skip

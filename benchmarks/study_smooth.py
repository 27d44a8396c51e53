"""Tables by straight lines and by the posterior mean: what they leave of every family of curves, whatever κ.

Curves of every family that leaves one table of residuals, measured at K even temperatures with noise; three
channels a unit, one κ. Rms of what a table leaves over the range, in shares of the table's residual at three
points: `lines`, `κ = 1` (what a plan foresees), `found` (as calibrate has it: REML beside what the spec's
table says), `REML` alone. Then of how many units in 100 calibrate would remark that their curves contradict
every family: where the table is right (1 at most), and where curves are 2, 4 and 1/4 times as large.

    python benchmarks/study_smooth.py [UNITS]
"""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the specs are the repository's own

from planner.calibrate.curve_contradiction import LEVEL, Nodes, nodes_at
from planner.calibrate.curve_nodes import CurveNodes, size_of
from planner.information.curves import Curves
from planner.nouns.array import Array
from planner.solvers.kriging import kriging_weights
from planner.spec.load import spec_from_bytes
from planner.temperature_table import hats
from tests.specs import SHIPPED

ERROR = ("gyro", "bias")
FAMILIES = ("cosines", "kink", "cubic", "matern")
NODES = (3, 4, 6, 10)
NOISE = (0.02, 0.3)  # of a node, in the table's residual at three points
SIZES = (1.0, 2.0, 4.0, 0.25)


def study(units: int) -> None:
    spec = spec_from_bytes((SHIPPED / "helicopter.yaml").read_bytes(), SHIPPED / "helicopter.yaml").spec
    curves = Curves(spec)
    low, high = spec.plan.temperatures.range
    residual = spec.unit.gyro["bias"].residual_table[3]
    fine = np.linspace(low, high, 61)
    print("family   nodes  noise   lines   κ = 1   found    REML   remarks of 100: ×1   ×2   ×4   ×¼")
    for K, noise in product(NODES, NOISE):
        nodes = np.linspace(low, high, K + 2)[1:-1]
        points = np.unique(np.concatenate([nodes, fine]))
        own, read = np.searchsorted(points, nodes), np.searchsorted(points, fine)
        pools = {family: curves.pool(family, ERROR, points) for family in FAMILIES}
        M = curves.prior(ERROR, points)
        assert M is not None
        C, known = (noise * residual) ** 2 * np.eye(K), M[np.ix_(own, own)]
        blank = [CurveNodes(ERROR, i, "xyz"[i], nodes, np.zeros(K), C, np.full(K, np.inf)) for i in range(3)]
        asked = nodes_at(blank, points, M)
        rng = np.random.default_rng(K)
        null = {family: asked.asked(asked.drawn(pool, rng)) for family, pool in pools.items()}
        for family, pool in pools.items():
            f = pool[rng.integers(len(pool), size=(3, units))]
            e = rng.normal(size=(3, units, K)) * noise * residual
            left = np.zeros(4)
            for u in range(units):
                v = f[:, u][:, own] + e[:, u]
                size = size_of([_with(c, x) for c, x in zip(blank, v, strict=True)], asked.moments)
                across = M[np.ix_(own, read)]
                smooth = [kriging_weights(k * known + C, k * across) for k in (1.0, size.value, size.most)]
                reads = [hats(fine, nodes, 5.0), *smooth]
                left += [np.mean((v @ w.T - f[:, u][:, read]) ** 2) / units for w in reads]
            remarks = [_remarked(asked, null, list(times * f[:, :, own] + e)) for times in SIZES]
            rms = " ".join(f"{x:7.3f}" for x in np.sqrt(left) / residual)
            print(
                f"{family:8s}{K:5d}{noise:8.2f} {rms}   " + " ".join(f"{x:9.1f}" for x in remarks), flush=True
            )


def _with(c: CurveNodes, values: Array) -> CurveNodes:
    return CurveNodes(c.error, c.channel, c.term, c.degc, values, c.noise, c.freedom)


def _remarked(asked: Nodes, null: dict[str, tuple[Array, Array]], values: list[Array]) -> float:
    """Of 100 units; values: (units, K) of every channel."""
    Q, D = asked.asked(values)
    size, shape = np.zeros(len(Q)), np.zeros(len(Q))
    for q, d in null.values():
        n = len(q)
        below = np.searchsorted(np.sort(q), Q, side="right")
        tails = np.minimum(1 + below, 1 + n - below) / (n + 1.0)
        size = np.maximum(size, np.minimum(1.0, 2.0 * tails))
        shape = np.maximum(shape, (1.0 + n - np.searchsorted(np.sort(d), D)) / (n + 1.0))
    return float(100.0 * np.mean(np.minimum(size, shape) < LEVEL / 2.0))


if __name__ == "__main__":
    study(int(sys.argv[1]) if len(sys.argv) > 1 else 400)

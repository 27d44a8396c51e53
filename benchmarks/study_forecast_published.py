"""K's network on K's own amount of data, beside K table 3.3: 21 weeks of twelve gyros, forecast to week 35.

Run as `python benchmarks/study_forecast_published.py`. The gyros are those of `tests.fleet.published_weeks`.
Weeks 1-14 in, 15-21 taught; forecast of weeks 22-28, and of 29-35 from its own output. Beside it: the last
value, and `local_trend`. Asserted: the second seven weeks are worse than the first, as in K, and the 95 %
intervals of the network hold for 90 % of the first.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from planner.fleet.forecast.neural import _teach, _windows
from tests.fleet.published_weeks import GYROS, KNOWN, drifts, figures

SEEDS = range(8)
PUBLISHED = "approximation 0.000013, forecast 0.0023, second forecast 0.0117 deg/s"


def approximation(values: np.ndarray) -> float:
    """rms of what the taught network misses of the weeks that taught it, deg/s."""
    taught = _teach([v[:KNOWN] for v in values])
    x, y = (np.concatenate([_windows(v[:KNOWN], taught.size)[i] for v in values]) for i in (0, 1))
    return float(np.sqrt(np.mean((taught.network.predict(x) - y) ** 2)) * taught.size)


def main() -> int:
    fleets = [drifts(np.random.default_rng(seed)) for seed in SEEDS]
    missed = np.mean([approximation(f) for f in fleets])
    print(f"K table 3.3: {PUBLISHED}")
    print(f"ours, {len(fleets)} times {GYROS} gyros; approximation {missed:.6f} deg/s")
    for name in ("neural", "naive", "local_trend"):
        first, second, inside = np.mean([figures(name, f) for f in fleets], axis=0)
        print(f"{name:12s} weeks 22-28 {first:.4f}, weeks 29-35 {second:.4f} deg/s; {inside:.0%} within 95 %")
        assert second > first
        assert name != "neural" or inside > 0.9
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The published model over limits and confidences: exhaustive search, and the genetic algorithm beside it.

The tests hold a few of these; here all of them, slowest last.

    OMP_NUM_THREADS=1 python benchmarks/study_published.py
"""

from __future__ import annotations

import sys
import time
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # the exhaustive search is the tests' own

from tests.reference.test_published import (
    test_the_genetic_algorithm_comes_within_half_a_percent_and_never_below as check_genetic,
)
from tests.reference.test_published import (
    test_the_optimum_of_the_published_model_is_the_optimum as check_optimum,
)

LIMITS = [(10, 95), (12, 90), (9, 99), (20, 99), (25, 68), (8, 95), (14, 80), (7, 95), (7.4, 99.7)]


def main() -> None:
    for limit, confidence in LIMITS:
        begin = time.perf_counter()
        check_optimum(limit, confidence)
        print(f"{limit} m at {confidence} %: the optimum, {time.perf_counter() - begin:.1f} s")
    for limit, seed in product(("10 m", "7 m"), (1, 2, 3)):
        begin = time.perf_counter()
        check_genetic(limit, seed)
        print(f"genetic, {limit}, seed {seed}: within 0.5 %, {time.perf_counter() - begin:.1f} s")


if __name__ == "__main__":
    main()

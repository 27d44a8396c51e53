"""K's printed tables against K's own formulas: which follow from them, and which do not.

`planner/docs/sources.md` says the same in words, table by table.
"""

import numpy as np
import pytest

from planner.plan.confidence import needed_repeats

MANY = 200_000


def test_table_2_16_asks_repeats_that_grow_slower_than_its_spreads():
    # K eq 27: n grows with s². Bias .006 -> .012 deg/s: four times as many; K prints 10 -> 15
    allowed = 1.96 * 0.006 / np.sqrt(10)
    assert needed_repeats(0.95, "normal", 0.006, allowed, MANY) == 10
    assert needed_repeats(0.95, "normal", 0.012, allowed, MANY) == 40


RATE, THREE_SIGMA, REPEATS = np.array(  # K table 2.17: deg/s, %, recommended repeats
    [
        (0.005, 39.7, 116600), (0.01, 24.3, 43900), (0.05, 6.6, 1833), (0.1, 4.9, 126), (1, 1.3, 7),
        (10, 0.32, 8), (50, 0.33, 8), (100, 0.32, 8), (200, 0.339, 9), (300, 0.351, 9), (400, 0.363, 10),
        (500, 0.367, 10),
    ]
).T  # fmt: skip


def test_table_2_17_asks_repeats_for_a_tenth_of_a_percent_with_three_rows_slipped():
    """K eq 27, n = (3δ/d)² with d = 0.115 %: all rows but 0.05, 0.1, 1 deg/s, which hold the next row's."""
    n = np.array([needed_repeats(0.95, "normal", d / 1.96, 0.115, MANY) for d in THREE_SIGMA])
    slipped = np.isin(RATE, [0.05, 0.1, 1.0])
    np.testing.assert_allclose(n[~slipped], REPEATS[~slipped], rtol=0.07, atol=1)
    for i in np.flatnonzero(slipped):
        assert n[i] > 1.7 * REPEATS[i]
        assert n[i + 1] == pytest.approx(REPEATS[i], rel=0.12, abs=1)


def test_tables_4_2_and_4_6_follow_the_formula_for_the_gyro_alone():
    """Half-widths of K 4.1.1 and 4.1.2, normal quantile at 95 %: printed 15, 10, 15, 10, then 5 and 2."""
    # gyro bias, gyro scale factor, accelerometer bias, accelerometer scale factor
    spread, allowed = (0.002, 0.002, 0.001, 0.002), (0.001, 0.01, 0.001, 0.01)
    asked = [needed_repeats(0.95, "normal", s, d, MANY) for s, d in zip(spread, allowed, strict=True)]
    assert asked == [16, 1, 4, 1]
    # 4.6: .002 deg/s and .0055 g are left
    assert needed_repeats(0.95, "normal", 0.002, 0.002, MANY) == 4
    assert needed_repeats(0.95, "normal", 0.001, 0.0055, MANY) == 1

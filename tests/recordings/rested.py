"""Rests of other people's recordings → dwell table, by a few lines of their own."""

from __future__ import annotations

import numpy as np

from planner.nouns.dwell_table import DwellTable


def rests(gyro: np.ndarray, rate_hz: float, least_s: float = 2.0) -> list[slice]:
    """Stretches in which the gyros scatter, over half seconds, less than twice the quietest quarter."""
    k = int(rate_hz / 2)
    windows = gyro[: len(gyro) // k * k].reshape(-1, k, 3)
    scatter = np.linalg.norm(windows.std(axis=1), axis=1)
    still = np.abs(windows.mean(axis=1) - np.median(windows.mean(axis=1), axis=0)).max(axis=1) < 0.02
    quiet = np.concatenate([[False], (scatter < 2.0 * np.percentile(scatter, 25)) & still, [False]])
    edges = np.flatnonzero(np.diff(quiet.astype(int)))
    return [
        slice(a * k + k // 2, b * k - k // 2)
        for a, b in zip(edges[::2], edges[1::2], strict=True)
        if (b - a) / 2 >= least_s
    ]


def table_of(acc: np.ndarray, gyro: np.ndarray, pieces: list[slice], rate_hz: float) -> DwellTable:
    """One row a piece; acc m/s², gyro rad/s."""
    n = len(pieces)
    middle = np.array([(p.start + p.stop) / 2.0 for p in pieces]) / rate_hz
    return DwellTable(
        unit=np.full(n, "u1"),
        run=np.ones(n, dtype=np.int64),
        day=np.zeros(n),
        time_on=middle,
        duration=np.array([(p.stop - p.start) / rate_hz for p in pieces]),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=None,
        ref_acc=None,
        gyro=np.array([gyro[p].mean(axis=0) for p in pieces]),
        acc=np.array([acc[p].mean(axis=0) for p in pieces]),
        acc_std=np.array([acc[p].std(axis=0) for p in pieces]),
    )

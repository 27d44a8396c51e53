"""Random parts of a coefficient over a campaign, of unit variance: per power-on, within it, over the days.

`generator` gives every one of them a generator of its own, so that other draws change nothing.
"""

from __future__ import annotations

import zlib

import numpy as np

from planner.campaign.design import Design
from planner.nouns.array import Array
from planner.spec.budget import STORAGE_DAYS


def generator(seed: int, *key: str) -> np.random.Generator:
    """The generator of one key."""
    words = [zlib.crc32(part.encode()) for part in key]
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=tuple(words)))


def power_on_draws(
    design: Design, temperature_degc: Array, length: float | None, rng: np.random.Generator
) -> Array:
    """(n,) one draw a power-on; with a length (K) one Gaussian process over temperature a power-on.

    E z(T) z(T') = exp(−(T − T')² / (2 L²)), drawn exactly at the power-on's own temperatures (n,)
    """
    runs = design.runs
    if length is None:
        draw = rng.normal(size=len(runs))
        return np.repeat(draw, [len(rows) for rows in runs])
    white, out = rng.normal(size=len(design)), np.zeros(len(design))
    for rows in runs:
        out[rows] = _root_over(temperature_degc[rows], length) @ white[rows]
    return out


def _root_over(temperature_degc: Array, length: float) -> Array:
    """(m, m) symmetric root of exp(−ΔT² / (2 L²)), which exists where temperatures repeat, too."""
    apart = np.subtract.outer(temperature_degc, temperature_degc) / length
    values, vectors = np.linalg.eigh(np.exp(-(apart**2) / 2.0))
    return np.asarray((vectors * np.sqrt(np.clip(values, 0.0, None))) @ vectors.T)


def gauss_markov(design: Design, time: float, rng: np.random.Generator) -> Array:
    """(n,) first-order Gauss-Markov of correlation time `time` (s) in every run, started at its spread."""
    starts = design.starts
    sizes = np.diff(np.append(starts, len(design)))
    noise, out = rng.normal(size=len(design)), np.zeros(len(design))
    out[starts] = noise[starts]
    for k in range(1, int(sizes.max(initial=0))):
        rows = starts[sizes > k] + k
        keep = np.exp(-np.abs(design.conditions.time_on[rows] - design.conditions.time_on[rows - 1]) / time)
        out[rows] = keep * out[rows - 1] + np.sqrt(1.0 - keep**2) * noise[rows]
    return out


def coloured(count: int, step: float, time: float, rng: np.random.Generator) -> Array:
    """(n,) first-order Gauss-Markov of unit variance, steps and time in s: a = e^(−step/time)."""
    from scipy.signal import lfilter

    keep = float(np.exp(-step / time))
    noise = np.sqrt(1.0 - keep**2) * rng.normal(size=count)
    noise[:1] /= np.sqrt(1.0 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], noise))


def walk(day: Array, rng: np.random.Generator) -> Array:
    """(n,) random walk over the days from zero at day 0, unit variance after STORAGE_DAYS."""
    moments, index = np.unique(day, return_inverse=True)
    steps = np.diff(np.concatenate([[0.0], moments]))
    walked = np.cumsum(np.sqrt(np.maximum(steps, 0.0) / STORAGE_DAYS) * rng.normal(size=len(moments)))
    return np.asarray(walked[index])

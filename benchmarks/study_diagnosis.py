"""How often a diagnosis is right, over seeds of a campaign that plain NumPy made (tests/calibrate/world.py).

Run: OMP_NUM_THREADS=1 python benchmarks/study_diagnosis.py [seeds] [workers]
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.calibrate.world import Hidden, Layout, Noise
from tests.diagnose.worlds import (
    ON_GYROS,
    named,
    named_on,
    rivals_of,
    searched,
    unnamed,
    unnamed_on,
)

ONE = (
    *ON_GYROS,
    ("scale_factor_nonlinearity", "acc_x"),
    ("scale_factor_asymmetry", "acc_y"),
    ("temperature_rate", "acc_z"),
    ("warm_up", "acc_x"),
    ("ageing", "acc_y"),
    ("bias_step", "acc_z"),
)
PAIRS = (
    ("warm_up", "ageing"),
    ("g_sensitivity", "temperature_rate"),
    ("scale_factor_asymmetry", "warm_up"),
    ("bias_step", "g_squared_sensitivity"),
    ("misalignment_temperature", "scale_factor_nonlinearity"),
)
UNKNOWN = ("day", "time_on", "temperature_rate", "rate", "orientation")
CLEAN = {
    "normal": (Noise(), Layout()),
    "Student-t": (Noise(kind="student"), Layout()),
    "grows with rate": (Noise(kind="grows"), Layout()),
    "correlated in a run": (Noise(kind="correlated"), Layout()),
    "one repeat": (Noise(), Layout(static_repeats=1, later=(), rate_repeats=1)),
    "two repeats": (Noise(), Layout(static_repeats=2, later=(30.0,), rate_repeats=2)),
    "outliers": (Noise(outliers=0.004), Layout()),
}


def one(case: tuple[int, str, str, float]) -> tuple[bool, bool, bool]:
    """(exactly, among the rivals, wrongly) named on its channel."""
    seed, effect, channel, strength = case
    sensor = "gyro" if channel.startswith("gyro") else "accelerometer"
    hidden = Hidden(effect, channel, tau_s=300.0 + 50.0 * (seed % 9))
    s = searched(seed, [hidden], sensor, strength=strength)
    names, others = named_on(s, channel[-1]), rivals_of(s)
    right = effect in names
    return right, right or effect in others, bool(names) and not right and effect not in others


def two(case: tuple[int, tuple[str, str]]) -> tuple[bool, bool]:
    """(both exactly, both among the rivals) named on their channel, and nothing unknown there."""
    seed, pair = case
    s = searched(seed, [Hidden(e, "gyro_x") for e in pair], strength=15.0)
    clear = not unnamed_on(s, "x")
    return named_on(s, "x") == set(pair) and clear, set(pair) <= named_on(s, "x") | rivals_of(s) and clear


def without_name(case: tuple[int, str]) -> tuple[bool, bool, bool]:
    """(flagged, right variable, a library effect claimed)."""
    seed, variable = case
    s = searched(seed, [Hidden(f"unknown_{variable}", "gyro_y")], strength=20.0)
    found = unnamed_on(s, "y")
    return bool(found), variable in found, bool(named_on(s, "y"))


def clean(case: tuple[int, str]) -> int:
    """Channels, of six, on which something is claimed."""
    seed, kind = case
    noise, layout = CLEAN[kind]
    claims = set()
    for sensor in ("gyro", "accelerometer"):
        s = searched(seed, sensor=sensor, noise=noise, layout=layout)
        claims |= {(sensor, a) for _, channels in named(s.found) | unnamed(s.found) for a in channels}
    return len(claims)


def share(flags: Sequence[bool]) -> str:
    return f"{sum(flags)}/{len(flags)}"


def main() -> None:
    seeds = range(7000, 7000 + (int(sys.argv[1]) if len(sys.argv) > 1 else 20))
    with ProcessPoolExecutor(int(sys.argv[2]) if len(sys.argv) > 2 else None) as pool:
        for kind in CLEAN:
            found = list(pool.map(clean, [(s, kind) for s in seeds]))
            print(f"nothing hides, {kind}: {sum(found)} claims on {6 * len(found)} channels", flush=True)
        for strength in (6.0, 12.0):
            rows = []
            for effect, channel in ONE:
                rows += (now := list(pool.map(one, [(s, effect, channel, strength) for s in seeds])))
                exact, rival, wrong = (share(column) for column in zip(*now, strict=True))
                print(
                    f"t = {strength:g}, {effect} on {channel}: exact {exact}, or rival {rival}, wrong {wrong}"
                )
            exact, rival, wrong = (share(column) for column in zip(*rows, strict=True))
            print(f"t = {strength:g}, all: exact {exact}, or rival {rival}, wrong {wrong}", flush=True)
        for pair in PAIRS:
            pairs = list(pool.map(two, [(s, pair) for s in seeds]))
            exact, rival = (share(column) for column in zip(*pairs, strict=True))
            print(f"two of 15 sigma, {pair}: both exact {exact}, or rivals {rival}", flush=True)
        for variable in UNKNOWN:
            found3 = list(pool.map(without_name, [(s, variable) for s in seeds]))
            flagged, right, library = (share(column) for column in zip(*found3, strict=True))
            print(
                f"unknown, {variable}: flagged {flagged}, variable {right}, library claimed {library}",
                flush=True,
            )


if __name__ == "__main__":
    main()

"""Recordings of any length go through in bounded memory, and in pieces of any size with the same result."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from planner.readers.packets import PACKET, crc8
from planner.recordings import windows as windows_module
from planner.recordings.column_map import read_map
from planner.recordings.raw_to_dwells import reduce_recordings
from planner.recordings.recording import Recording
from planner.recordings.windows import halved, windows_of
from tests.calibrate.measured_command import PACKET_MAP, measured
from tests.calibrate.test_apply import document, tables
from tests.recordings.recordings import save, tumbled
from tests.recordings.test_reduce import samples_told


def stream(path: Path, seconds: int) -> Path:
    """Packets at 1 kHz: rests of 20 s and turns of 4 s about z."""
    rng = np.random.default_rng(1)
    rows = np.zeros(seconds * 1000, PACKET)
    time = np.arange(len(rows)) / 1000
    rows["P"], rows["C"] = 0x1B, 1
    rows["W"] = rng.normal(0.0, 0.05, (len(rows), 3))
    rows["W"][:, 2] += np.where(time % 24 > 20, 45 * (1 - np.cos(np.pi / 2 * (time % 24 - 20))), 0)
    rows["A"] = rng.normal(0.0, 0.002, (len(rows), 3)) + np.array([0, 0, 1])
    rows["T"] = 2000
    data = rows.view("u1").reshape(len(rows), 34)
    data[:, 33] = crc8(data[:, :33])
    rows.tofile(path)
    return path


def peak_kilobytes(folder: Path, *arguments: str) -> int:
    if not Path("/proc/self/status").exists():
        pytest.skip("the peak of a process is read from /proc")
    return measured(folder, *arguments)[1]


def test_memory_does_not_grow_with_the_file(tmp_path):
    (tmp_path / "map.yaml").write_text(PACKET_MAP)
    stream(tmp_path / "small.bin", 72)
    stream(tmp_path / "large.bin", 672)  # 23 MB, as doubles in memory 54 MB
    tail = ("--columns", "map.yaml", "-o", "out.csv")
    small = peak_kilobytes(tmp_path, "reduce", "small.bin", *tail)
    large = peak_kilobytes(tmp_path, "reduce", "large.bin", *tail)
    # of 600 s more only their windows stay: 20 a second at 230 bytes, some times over while they are judged
    assert large - small < 33_000


def test_memory_of_apply_does_not_grow_with_the_file(tmp_path):
    (tmp_path / "map.yaml").write_text(PACKET_MAP)
    (tmp_path / "calibration.json").write_text(json.dumps(document(tables(1, np.radians(1.0)))))
    stream(tmp_path / "small.bin", 300)
    stream(tmp_path / "large.bin", 900)
    tail = ("--columns", "map.yaml", "-o", "out.csv")
    small = peak_kilobytes(tmp_path, "apply", "calibration.json", "small.bin", *tail)
    large = peak_kilobytes(tmp_path, "apply", "calibration.json", "large.bin", *tail)
    assert large - small < 20_000  # 600 000 samples more are 38 MB as they come and 80 MB as text


@pytest.mark.parametrize("batch", [1 << 11, 1 << 13, 1 << 20])
def test_the_size_of_the_batches_changes_nothing(tmp_path, batch, monkeypatch):
    path = save(tmp_path / "a.csv", tumbled(rest=12.0).readings(0.05, 0.002, 1))
    whole = reduce_recordings([path]).table
    monkeypatch.setattr(windows_module, "BATCH", batch)
    pieces = reduce_recordings([path]).table
    np.testing.assert_allclose(pieces.gyro, whole.gyro, rtol=1e-12)
    assert pieces.n_samples.tolist() == whole.n_samples.tolist()


def test_hours_are_kept_in_longer_windows(tmp_path, monkeypatch):
    """When windows grow too many, neighbours are joined: rests, means and the account stay."""
    recorded = tumbled(rest=40.0)
    path = save(tmp_path / "a.csv", recorded.readings(0.05, 0.002, 1))
    fine = reduce_recordings([path])
    monkeypatch.setattr(windows_module, "MOST_WINDOWS", 1500)
    monkeypatch.setattr(windows_module, "BATCH", 1 << 11)
    coarse = reduce_recordings([path])
    assert len(coarse.rows) == len(fine.rows) == 6
    assert samples_told(coarse) == len(recorded.time)
    # windows of 0.2 s instead of 0.05 s: the rows begin and end elsewhere by as much, of 40 s
    assert np.abs(np.degrees(coarse.table.gyro - fine.table.gyro)).max() < 0.05 / np.sqrt(8000)


@pytest.mark.parametrize("count", [64, 65, 127])
def test_joined_windows_have_the_moments_of_all_samples(tmp_path, count):
    values = tumbled(turns=(), rest=count * 10 / 200).readings(0.05, 0.002, 1)
    path = save(tmp_path / "a.csv", values, fmt="%.17g")
    windows = windows_of(Recording(path).samples(), 200.0)
    joined = halved(windows)
    assert len(joined) == (count + 1) // 2
    part = np.radians(values[:20, 1:4])
    np.testing.assert_allclose(joined.mean[0, :3], part.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(joined.variance[0, :3], part.var(axis=0, ddof=1), rtol=1e-9)
    assert joined.count.sum() == windows.count.sum() == len(values)


def test_a_damaged_stream_reduces_with_its_losses_told(tmp_path):
    (tmp_path / "map.yaml").write_text(PACKET_MAP)
    clean = reduce_recordings([stream(tmp_path / "a.bin", 60)], read_map(tmp_path / "map.yaml"))
    data = np.fromfile(tmp_path / "a.bin", np.uint8)
    hit = np.random.default_rng(1).choice(60_000, 300, replace=False)
    data[hit * 34 + 7] ^= 0xFF
    (tmp_path / "b.bin").write_bytes(b"noise" + data.tobytes()[:-10])
    found = reduce_recordings([tmp_path / "b.bin"], read_map(tmp_path / "map.yaml"))
    lost = int(301 - (59_999 in hit))  # the last packet is cut
    assert found.counts[str(tmp_path / "b.bin")]["damaged_bytes"] == 5 + 34 * lost - 10
    assert samples_told(found) == 60_000 - lost
    assert len(found.rows) == len(clean.rows)
    # 300 of 60 000 samples less: a tenth of the noise of a mean
    assert np.abs(np.degrees(found.table.gyro - clean.table.gyro)).max() < 0.1 * 0.05 / np.sqrt(20_000) * 5

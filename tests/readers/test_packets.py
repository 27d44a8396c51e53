"""The packet stream: whole packets come through whatever lies between them, and every byte is counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.protocols import RawBlock
from planner.readers import packets as reader
from planner.readers.packets import LENGTH, READER, crc8, find_packets
from tests.readers.streams import checksum, packet, packets

STREAM = packets(300)


def read(
    path: Path, data: bytes, chunk: int | None = None, monkeypatch: pytest.MonkeyPatch | None = None
) -> RawBlock:
    """All blocks as one."""
    path.write_bytes(data)
    if chunk is not None and monkeypatch is not None:
        monkeypatch.setattr(reader, "CHUNK_BYTES", chunk)
    blocks = list(READER.blocks(path, reader.NAMES))
    losses: dict[str, int] = {}
    for block in blocks:
        for reason, count in block.losses.items():
            losses[reason] = losses.get(reason, 0) + count
    return RawBlock(
        {name: np.concatenate([b.columns[name] for b in blocks]) for name in reader.NAMES},
        np.concatenate([b.sample for b in blocks]),
        losses,
        tuple(r for b in blocks for r in b.remarks),
    )


@settings(deadline=None, max_examples=60)
@given(st.binary(min_size=33, max_size=33))
def test_the_checksum_is_that_of_the_polynomial(data):
    assert crc8(np.frombuffer(data, np.uint8)[None, :])[0] == checksum(data)


def test_every_field_stands_where_the_format_says(tmp_path):
    data = packet((1.5, -2.5, 3.25), (0.5, -0.25, 9.75), (-300, 2000, 32767), mark=200, ready=3)
    found = read(tmp_path / "a.bin", data * 2)
    row = [
        found.columns[name][0] for name in ("W1", "W2", "W3", "A1", "A2", "A3", "T1", "T2", "T3", "L", "C")
    ]
    assert row == [1.5, -2.5, 3.25, 0.5, -0.25, 9.75, -300, 2000, 32767, 200, 3]


def test_one_wrong_bit_anywhere_is_noticed():
    """A CRC-8 sees every single wrong bit."""
    good = np.frombuffer(STREAM[7], np.uint8)
    for bit in range(LENGTH * 8):
        bad = good.copy()
        bad[bit // 8] ^= np.uint8(1 << bit % 8)
        assert len(find_packets(bad).offset) == 0


def test_a_whole_stream_has_no_losses(tmp_path):
    found = read(tmp_path / "a.bin", b"".join(STREAM))
    assert found.columns["W1"].tolist() == list(range(300))
    assert found.sample.tolist() == list(range(300))
    assert not found.losses


@settings(deadline=None, max_examples=60)
@given(
    st.lists(st.tuples(st.integers(0, 300), st.binary(min_size=1, max_size=80)), max_size=6),
    st.integers(0, 33),
)
def test_packets_come_through_foreign_bytes(tmp_path_factory, inserted, cut):
    # without a prefix byte the foreign bytes hold no false packet, so every whole packet must be found
    pieces = list(STREAM[:300])
    foreign = 0
    for place, data in sorted(inserted, reverse=True):
        clean = data.replace(b"\x1b", b"\x00")
        pieces.insert(place, clean)
        foreign += len(clean)
    data = b"".join(pieces) + STREAM[0][:cut]
    found = read(tmp_path_factory.mktemp("p") / "a.bin", data)
    assert found.columns["W1"].tolist() == list(range(300))
    assert found.losses.get("damaged_bytes", 0) == foreign + cut


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_damaged_bytes_cost_their_packets_only(tmp_path, seed):
    rng = np.random.default_rng(seed)
    data = np.frombuffer(b"".join(STREAM), np.uint8).copy()
    hit = np.sort(rng.choice(300, 25, replace=False))
    data[hit * LENGTH + rng.integers(0, LENGTH, 25)] ^= rng.integers(1, 256, 25).astype(np.uint8)
    found = read(tmp_path / "a.bin", data.tobytes())
    kept = np.setdiff1d(np.arange(300), hit)
    assert found.columns["W1"].tolist() == kept.tolist()
    assert found.losses["damaged_bytes"] == 25 * LENGTH


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_clock_goes_on_over_damaged_packets(tmp_path, seed):
    """A packet that was damaged still took its millisecond; one that lost some bytes cannot be told of."""
    rng = np.random.default_rng(seed)
    data = np.frombuffer(b"".join(STREAM), np.uint8).copy()
    hit = np.sort(rng.choice(np.arange(1, 299), 20, replace=False))
    data[hit * LENGTH + 5] ^= 0x40
    found = read(tmp_path / "a.bin", data.tobytes())
    assert found.sample.tolist() == np.setdiff1d(np.arange(300), hit).tolist()
    assert found.losses["lost_packets"] == 20


@pytest.mark.parametrize("chunk", [LENGTH + 1, 100, 1000, 3333, 10200])
def test_the_size_of_the_pieces_changes_nothing(tmp_path, chunk, monkeypatch):
    data = (
        b"".join(STREAM[:100])
        + b"\x00\x1b\x07"
        + b"".join(STREAM[100:200])
        + STREAM[5][:20]
        + b"".join(STREAM[200:])
    )
    whole = read(tmp_path / "a.bin", data)
    pieces = read(tmp_path / "b.bin", data, chunk, monkeypatch)
    assert pieces.columns["W1"].tolist() == whole.columns["W1"].tolist() == list(range(300))
    assert pieces.losses["damaged_bytes"] == whole.losses["damaged_bytes"] == 23
    assert pieces.sample.tolist() == whole.sample.tolist()


@settings(deadline=None, max_examples=60)
@given(st.binary(max_size=400))
def test_any_bytes_are_read_or_refused(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("p") / "a.bin"
    path.write_bytes(data)
    found = find_packets(np.frombuffer(data, np.uint8))
    assert found.skipped + LENGTH * len(found.offset) == len(data)
    if not len(found.offset):
        with pytest.raises(InputError, match="not one whole packet"):
            list(READER.blocks(path, reader.NAMES))


def test_a_stream_is_known_by_what_it_holds(tmp_path):
    path = tmp_path / "recording"
    assert READER.recognises(path, b"junk" + b"".join(STREAM[:5]))
    assert not READER.recognises(path, b"time,gyro\n1,2\n" * 20)

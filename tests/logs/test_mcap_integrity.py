"""Remarks on MCAP files name the bytes checked against damage, and those that are damaged."""

from __future__ import annotations

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter

from log_fixtures import join, made_up, refusal, same, write
from tumble.logs import open_recording
from turntable_sessions import typed

SAMPLES = 400


@pytest.fixture(scope="module")
def chunk():
    return made_up(SAMPLES)


@pytest.fixture
def log(tmp_path, chunk):
    return write(tmp_path / "log.mcap", chunk)


def written_without_checksums(path, source):
    """The same messages in a file whose writer counted no checksum."""
    with source.open("rb") as old, path.open("wb") as new:
        writer = McapWriter(new, enable_crcs=False)
        writer.start()
        ids: dict[int, int] = {}
        for schema, channel, message in make_reader(old).iter_messages():
            if channel.id not in ids:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                ids[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, known)
            writer.add_message(ids[channel.id], message.log_time, message.data, message.publish_time)
        writer.finish()
    return path


def summary_of(path):
    with path.open("rb") as file:
        return make_reader(file).get_summary()


def flip(path, place):
    data = bytearray(path.read_bytes())
    data[place] ^= 0x5A
    path.write_bytes(bytes(data))


def remarks(path):
    return " | ".join(open_recording(path).metadata.remarks)


def test_a_file_with_all_checksums_gets_no_remark(log):
    assert remarks(log) == ""


def test_a_file_without_checksums_is_read_with_a_remark(tmp_path, log, chunk):
    path = written_without_checksums(tmp_path / "bare.mcap", log)
    assert same(join(list(open_recording(path).chunks())), chunk)
    chunks = len(summary_of(path).chunk_indexes)
    assert f"{chunks} of {chunks} chunks carry no checksum" in remarks(path)
    assert "the index carries no checksum" in remarks(path)
    done = typed("inspect", path)
    assert done.code == 0, done.err
    assert "carry no checksum: damaged readings would not show" in done.text


@pytest.mark.parametrize("place", ["first", "middle", "offsets"])
def test_a_damaged_summary_is_said_and_the_log_read_without_it(log, chunk, place):
    data = log.read_bytes()
    start = int.from_bytes(data[-28:-20], "little")
    flip(log, {"first": start + 20, "middle": (start + len(data)) // 2, "offsets": len(data) - 45}[place])
    assert same(join(list(open_recording(log).chunks())), chunk)
    assert "the index is damaged, its checksum differs: read without it" in remarks(log)


def test_a_damaged_footer_is_said_and_the_log_read_without_the_index(log, chunk):
    flip(log, -37)
    found = open_recording(log)
    assert "the footer is damaged" in remarks(log)
    assert same(join(list(found.chunks())), chunk)


def test_a_damaged_index_of_messages_is_said(log, chunk):
    index = summary_of(log).chunk_indexes[0]
    flip(log, next(iter(index.message_index_offsets.values())))
    assert "the index of messages is damaged in 1 of" in remarks(log)
    assert same(join(list(open_recording(log).chunks())), chunk)


def test_a_byte_flipped_anywhere_is_said_or_harms_no_reading(log, chunk):
    seed = 6
    print(f"seed {seed}")
    whole = log.read_bytes()
    for place in np.random.default_rng(seed).integers(8, len(whole), 12):
        log.write_bytes(whole)
        flip(log, int(place))
        try:
            read = join(list(open_recording(log).chunks()))
        except Exception:
            assert str(log) in refusal(log)
        else:
            assert same(read, chunk), f"byte {place}"

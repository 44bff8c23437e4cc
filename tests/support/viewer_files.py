"""Files for viewers read by the libraries of others: Rerun's own reader, mcap's and rosbags."""

import subprocess
import sys
from functools import lru_cache
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

MOST_KEPT = 4
"""Files of one kind that are kept as they were read: tests read one again after others."""


@lru_cache(MOST_KEPT)
def rerun_chunks(path):
    """Temporal chunks of Rerun by entity, as pyarrow tables, after its own verification."""
    from rerun.chunk import RrdReader

    program = Path(sys.executable).with_name("rerun")
    subprocess.run([program, "rrd", "verify", path], check=True, capture_output=True)
    reader = RrdReader(str(path))
    assert [each.application_id for each in reader.blueprints()] == ["tumble"]
    found = {}
    for chunk in reader.stream().to_chunks():
        if not chunk.is_static:
            found.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
    return found


def column(batches, name):
    """Values of a column of chunks, in order of time: one list for each row."""
    rows = []
    for batch in batches:
        times = batch.column("time").cast("int64").to_pylist()
        rows += zip(times, batch.column(name).to_pylist(), strict=True)
    rows.sort(key=lambda row: row[0])
    return np.array([time for time, _ in rows]) * 1e-9, [value for _, value in rows]


@lru_cache(MOST_KEPT)
def mcap_messages(path, *topics):
    """Messages of these topics, or of all, as rosbags reads them, after Foxglove's library did."""
    with Path(path).open("rb") as file:
        counts = {}
        for _, channel, _ in make_reader(file, validate_crcs=True).iter_messages():
            if not topics or channel.topic in topics:
                counts[channel.topic] = counts.get(channel.topic, 0) + 1
    found = {}
    with AnyReader([Path(path)]) as bag:
        wanted = [each for each in bag.connections if not topics or each.topic in topics]
        for connection, stamp, raw in bag.messages(wanted):
            message = bag.deserialize(raw, connection.msgtype)
            found.setdefault(connection.topic, []).append((stamp, message))
    assert {topic: len(messages) for topic, messages in found.items()} == counts
    return found


def triads_of(messages):
    """Specific force and angular rate (n, 3) of messages of `sensor_msgs/Imu`."""
    return tuple(
        np.array([[getattr(getattr(message, field), axis) for axis in "xyz"] for _, message in messages])
        for field in ("linear_acceleration", "angular_velocity")
    )

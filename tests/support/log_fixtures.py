"""Made-up recordings and files for the tests of logs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tumble.foundation.errors import LogError
from tumble.foundation.recording import Chunk
from tumble.logs import Facts, open_recording, open_writer

DATA = Path(__file__).parents[3] / "shared" / "data"


def real(name):
    """Path of a real recording; skips, with a message, where the shared data are absent."""
    path = DATA / name
    if not path.exists():
        pytest.skip(f"no real recording: {path} is absent")
    return path


def made_up(samples=2000, rate=200.0, seed=1, start=0.0, temperature=True):
    """At rest with z up, then turning about z, with noise: a Chunk."""
    random = np.random.default_rng(seed)
    time = start + np.arange(samples) / rate
    accelerometer = random.normal([0.1, -0.2, 9.8], 0.02, (samples, 3))
    gyroscope = random.normal(0.0, 0.002, (samples, 3))
    gyroscope[samples // 2 :, 2] += 1.0
    degrees = 25.0 + np.linspace(0.0, 1.0, samples)
    return Chunk(time, accelerometer, gyroscope, degrees if temperature else None)


def of_one_unit(recordings):
    """Recordings without the serial numbers by which those of several seeds differ."""
    return [replace(each, metadata=replace(each.metadata, serial="")) for each in recordings]


def assert_said_to_be_cut_short(path, whole):
    """Checks that a log without its end is refused in a line on that, or read up to there with a remark."""
    try:
        recording = open_recording(path)
    except LogError as error:
        line = str(error)
    else:
        line = ""
    if line:
        assert str(path) in line
        assert "cut short" in line
        return
    assert any("breaks off" in remark for remark in recording.metadata.remarks)
    found = join(list(recording.chunks()))
    assert np.array_equal(found.gyroscope, whole.gyroscope[: len(found)])


def write(path, chunk, **facts):
    """Writes a chunk with our own writers."""
    with open_writer(path, facts=Facts(**facts)) as writer:
        writer.write(chunk)
    return path


def write_text(path, chunk, header="time,ax,ay,az,gx,gy,gz", delimiter=",", scale=(1.0, 1.0, 1.0)):
    """Writes a text table with columns time, accelerometer, gyroscope, each in a unit of its own."""
    table = np.column_stack(
        [chunk.time * scale[0], chunk.accelerometer * scale[1], chunk.gyroscope * scale[2]]
    )
    rows = [delimiter.join(repr(float(value)) for value in row) for row in table]
    path.write_text("\n".join([header, *rows] if header else rows) + "\n")
    return path


def read(source, options=None):
    """The whole recording as one Chunk."""
    return join(list(open_recording(source, options).chunks()))


def join(chunks):
    temperatures = [chunk.temperature for chunk in chunks]
    return Chunk(
        np.concatenate([chunk.time for chunk in chunks]),
        np.concatenate([chunk.accelerometer for chunk in chunks]),
        np.concatenate([chunk.gyroscope for chunk in chunks]),
        None if temperatures[0] is None else np.concatenate(temperatures),
    )


def same(left, right):
    """Returns whether two chunks hold exactly the same floats."""
    pairs = [
        (left.time, right.time),
        (left.accelerometer, right.accelerometer),
        (left.gyroscope, right.gyroscope),
    ]
    if left.temperature is not None or right.temperature is not None:
        pairs.append((left.temperature, right.temperature))
    return all(np.array_equal(one, other, equal_nan=True) for one, other in pairs)


def refusal(source, options=None):
    """The line with which a log is refused, on opening or while it streams by."""
    with pytest.raises(LogError) as caught:
        for _ in open_recording(source, options).chunks():
            pass
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) > 20
    return message

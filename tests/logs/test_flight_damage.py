"""Flight logs that are cut, garbled or hostile: read as far as they are sound, or refused in one line."""

import re
import tracemalloc
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from dataflash_fixtures import DataFlashWriter
from hostile import for_long
from mavlink_fixtures import autopilot, scaled, tlog_of
from tumble.foundation.errors import TumbleError
from tumble.logs import ReadOptions, list_imus, open_recording
from tumble.logs.walk import BLOCK, Damage, walk
from tumble.tools.inspect.procedure import inspect
from ulog_fixtures import ULogWriter, turning

MOST_MEMORY = 64 << 20
"""Bytes, for files of some 100 kB."""

PHASES = (Phase.explicit, Phase.reuse, Phase.generate)
"""Examples are not made smaller: they would be large all the same."""

cheap = settings(max_examples=8, suppress_health_check=list(HealthCheck), phases=PHASES)


def ulog():
    time, force, turn = turning(np.random.default_rng(1), 300)
    writer = ULogWriter({"CAL_ACC0_ID": 1, "CAL_ACC0_XOFF": 0.3, "SENS_BOARD_ROT": 4})
    for topic, values in (("sensor_accel", force), ("sensor_gyro", turn)):
        writer.add(topic, 0, time, device_id=1, **dict(zip("xyz", values.T, strict=True)))
    writer.add("sensor_combined", 0, time, gyro_rad=turn, accelerometer_m_s2=force)
    for topic in ("sensor_accel_fifo", "sensor_gyro_fifo"):
        writer.add(topic, 0, time[:50], device_id=1, dt=125.0, scale=0.01, samples=8, x=3, y=5, z=900)
    return writer.change(2.5, "CAL_ACC0_XOFF", 0.2).drop(3.0, 20).content()


def dataflash():
    time, force, turn = turning(np.random.default_rng(2), 200)
    writer = DataFlashWriter({"INS_ACCOFFS_X": 0.3, "AHRS_ORIENTATION": 4, "INS_LOG_BAT_OPT": 0})
    writer.triads("IMU", time, force, turn).triads("ACC", time, force, turn)
    return writer.batch(1, 0, 0, 5.0, 4000.0, 2048, np.full((100, 3), 2048))


CONTENTS = {
    "ulg": ulog(),
    "bin": dataflash().content(),
    "log": dataflash().text().encode(),
    "tlog": tlog_of(scaled(200, autopilot())),
}


@st.composite
def damaged(draw, content):
    """Cuts, garbles, double or leaves out pieces."""
    content = bytearray(content)
    for _ in range(draw(st.integers(1, 6))):
        at = draw(st.integers(7, max(len(content) - 1, 7)))
        match draw(st.sampled_from(("bytes", "ones", "cut", "leave out", "double"))):
            case "bytes":
                piece = draw(st.binary(min_size=1, max_size=40))
                content[at : at + len(piece)] = piece
            case "ones":
                content[at : at + 8] = b"\xff" * 8
            case "cut":
                del content[at:]
            case "leave out":
                del content[at : at + draw(st.integers(1, 3000))]
            case "double":
                content[at:at] = content[at : at + draw(st.integers(1, 3000))]
    return bytes(content)


@dataclass(frozen=True)
class Content:
    """Bytes of a log, which nobody wants to see written out."""

    data: bytes = field(repr=False)


def in_one_line(attempt, *arguments):
    """Returns what it gives; only an error of one line may come of it."""
    try:
        return attempt(*arguments)
    except TumbleError as error:
        said = str(error)
    assert len(said.splitlines()) == 1
    return ()


def read(source, options):
    return inspect(open_recording(source, options))


def tried(path):
    """Reads all that is there, as `inspect` does."""
    for name in in_one_line(list_imus, path):
        for undo in (False, True):
            options = ReadOptions(undo_correction=undo)
            in_one_line(read, f"{path}:{name}" if name else path, options)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("ending", sorted(CONTENTS))
def test_damaged_flight_log_is_read_or_refused_within_its_memory(tmp_path, ending):
    path = tmp_path / f"flight.{ending}"

    @cheap
    @given(st.data())
    def attempt(data):
        path.write_bytes(data.draw(damaged(CONTENTS[ending]).map(Content)).data)
        tracemalloc.start()
        try:
            tried(path)
            assert tracemalloc.get_traced_memory()[1] < MOST_MEMORY
        finally:
            tracemalloc.stop()

    for_long(attempt)


@pytest.mark.parametrize("places", [(0,), (0, 40 << 30), (0, 40 << 30, (40 << 30) + 5 * BLOCK), (90 << 30,)])
def test_of_a_hole_in_a_log_little_is_read(tmp_path, places):
    path = tmp_path / "log.ulg"
    with path.open("wb") as file:
        for place in places:
            file.seek(place)
            file.write(b"message")
        file.truncate(100 << 30)
    read, found = [], []

    def take(data, position, whole):
        read.append(len(data))
        found.extend(position + match.start() for match in re.finditer(b"message", data))
        return len(data) if whole else max(len(data) - 6, 0)

    with path.open("rb") as file:
        for _ in walk(file, 0, 100 << 30, take, Damage()):
            pass
    assert found == list(places)
    assert sum(read) < 32 * BLOCK

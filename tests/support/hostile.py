"""Files of any format, corrupted: cut short, with bytes changed, and with sizes that nothing can have."""

from __future__ import annotations

import os
import tracemalloc

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from repetitions import SOAK
from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.logs import ReadOptions, list_imus, open_recording

EXAMPLES = 40
"""Corrupted files of one format at a time."""
SOAK_SECONDS = float(os.environ.get("TUMBLE_SOAK_SECONDS", "600"))
"""For each parser, in `make soak`."""
MOST_BYTES = 64 << 20
"""Memory for a file of a hundred kilobytes: its chunks and the buffers of pyarrow and numpy, no size in
it."""
_SIZES = [0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, (1 << 63) - 1, (1 << 64) - 1]

few = settings(
    max_examples=EXAMPLES,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def for_long(check, share=1.0):
    """Tests a property with a few examples; in `make soak`, with ever new ones for this share of the time."""
    until = clock.now() + share * SOAK_SECONDS
    check()
    while SOAK and clock.now() < until:
        check()


@st.composite
def corrupted(draw, whole):
    """The bytes of a file with one to four changes, mostly near its beginning or end, where sizes stand."""
    data = bytearray(whole)
    for _ in range(draw(st.integers(1, 4))):
        last = max(len(data) - 1, 0)
        place = draw(
            st.one_of(
                st.integers(0, min(last, 512)), st.integers(max(last - 512, 0), last), st.integers(0, last)
            )
        )
        change = draw(st.sampled_from(["byte", "size", "cut", "drop", "repeat"]))
        if change == "byte" and data:
            data[place] = draw(st.integers(0, 255))
        elif change == "size":
            width = draw(st.sampled_from([1, 2, 4, 8]))
            size = draw(st.sampled_from(_SIZES)) & ((1 << 8 * width) - 1)
            order = draw(st.sampled_from(["little", "big"]))
            data[place : place + width] = size.to_bytes(width, order)
        elif change == "cut":
            del data[place:]
        elif change == "drop":
            del data[place : place + draw(st.integers(1, 16))]
        else:
            data[place:place] = data[place : place + draw(st.integers(1, 64))]
    return bytes(data)


def read_or_refuse(path, options=None):
    """Reads the contents of a file; a `LogError` of one line is as good. Gives the peak of memory."""
    options = options or ReadOptions()
    said = ""
    tracemalloc.start()
    try:
        for imu in list_imus(path, options):
            for _ in open_recording(f"{path}:{imu}" if imu else path, options).chunks():
                pass
    except LogError as error:
        said = str(error)
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert "\n" not in said
    return peak

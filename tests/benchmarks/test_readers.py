"""The benchmark of readers reads what it writes."""

from __future__ import annotations

import pytest
from benchmarks.readers import READERS, made_up, read_all

from tumble.foundation.log_formats import LOG_FORMATS, PACKINGS


@pytest.mark.parametrize("name", READERS)
def test_a_reader_gives_every_sample_that_the_benchmark_wrote(tmp_path, name):
    path = READERS[name].write(tmp_path, made_up(300))
    assert read_all(path, timeless=READERS[name].timeless) == 300
    assert READERS[name].bare(path) is not None


def test_every_format_of_the_benchmark_is_one_that_is_read():
    packed = {f"csv{packing.ending}" for packing in PACKINGS.values()}
    assert {name.split(",")[0] for name in READERS} <= {each.name for each in LOG_FORMATS} | packed

"""Passes over a log that are left half way, or by a fork: whoever reads next is not held up by them."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import pytest

from log_fixtures import made_up, write_text
from patience import PATIENCE
from tumble.logs.ahead import ahead

SAMPLES = 6000
BEGIN = """
import gc, os, sys
from pathlib import Path
from tumble.logs import csv
from tumble.logs.options import ReadOptions


csv.CHUNK_SAMPLES = 1  # the smallest blocks: many in a small file
log = csv.open_logged_imu(Path(sys.argv[1]), None, ReadOptions())

def a_pass():
    return log.read(lambda samples: samples)
"""
ABANDON = """
gc.freeze()
for objects in range(1, 80):
    gc.disable()
    abandoned, later = a_pass(), a_pass()
    next(abandoned)
    gc.collect()
    cycle = [abandoned]
    cycle.append(cycle)
    del abandoned, cycle  # none but the garbage collector ends that pass
    gc.set_threshold(objects)  # made before it runs: sooner or later that is in a thread that is starting
    gc.enable()
    next(later)
    later.close()
"""
FORK = """
list(a_pass())
if child := os.fork():
    sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
END = """
print(sum(len(samples.time) for samples in a_pass()))
"""


@pytest.mark.parametrize(
    "before",
    [ABANDON, pytest.param(FORK, marks=pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here"))],
    ids=["abandoned", "forked"],
)
def test_a_pass_ends_whatever_became_of_those_before(before, tmp_path):
    log = write_text(tmp_path / "log.csv", made_up(SAMPLES))
    done = subprocess.run(
        [sys.executable, "-c", BEGIN + before + END, log],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) == SAMPLES


def test_abandoned_pass_that_reads_ahead_holds_up_no_beginning_thread():
    begin = """
import gc
from tumble.logs.ahead import ahead

def a_pass():
    return ahead(iter(range(1, 100)))
"""
    done = subprocess.run(
        [sys.executable, "-c", begin + ABANDON + "print(sum(a_pass()))"],
        capture_output=True,
        text=True,
        check=True,
        timeout=PATIENCE,
    )
    assert done.stdout == f"{sum(range(1, 100))}\n"


def test_a_pass_that_is_closed_has_read_the_part_that_it_began():
    """Otherwise the file would be closed beneath a thread that reads it."""
    begun, may_end, happened = threading.Event(), threading.Event(), []

    def parts():
        yield 1
        begun.set()
        may_end.wait()
        happened.append("read")
        yield 2

    reading = ahead(parts())
    assert next(reading) == 1
    begun.wait()
    closing = threading.Thread(target=lambda: (reading.close(), happened.append("closed")))
    closing.start()
    for _ in range(100_000):
        if not closing.is_alive():
            break
    may_end.set()
    closing.join()
    assert happened == ["read", "closed"]

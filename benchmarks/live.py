"""Eight units at 1 kHz, read, put on one clock, corrected and sent on: losses, processor, latency, memory.

`python -m benchmarks.live [--seconds 30] [--units 8] [--rate 1000] [--no-save]`
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.results import Content, machine, save
from tumble.calibration.document import Calibration
from tumble.live import LiveChunk, LiveSet, PolledSource, open_set
from tumble.live.conditioning import HEAD_SAMPLES
from tumble.live.outputs import parse_output
from tumble.logs import Facts

SECONDS, UNITS, RATE = 30.0, 8, 1000.0
HOURS = 1.0
PIECE = 50
"""Samples that come together in what is put through for memory."""
WAYS = ("udp", "pty")
SILENCE = 5.0
"""s without a sample after which no more are to come."""
LARGEST_LATENCY = {"p99": 2e-3, "p99.9": 10e-3}
"""s, from when a sample is sent to when it is sent on."""
LARGEST_SHARE = 0.5
"""Largest share of one core."""
LARGEST_GROWTH = 1.05
"""Largest growth of memory, from the second half of the first fifth to the end."""


def run(over: str, units: int, rate: float, seconds: float) -> Content:
    """Receives from senders in a process of their own."""
    asked = {"over": over, "units": units, "rate": rate, "seconds": seconds}
    sender = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.live_senders", json.dumps(asked)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parent.parent,
    )
    assert sender.stdin is not None
    assert sender.stdout is not None
    addresses = json.loads(sender.stdout.readline())
    words = [f"unit_{number}={address}" for number, address in enumerate(addresses)]
    sent = units * int(seconds * rate)
    figures = _receive(words, sender, sent)
    sender.stdin.close()
    sender.wait()
    return {"over": over, "sent": sent, "lost": sent - figures.pop("received"), **figures}


def _receive(words: list[str], sender: subprocess.Popen[str], sent: int) -> Content:
    calibration = Calibration.model_validate(
        {
            "schema": "tumble-calibration/1",
            "name": "unit",
            "accelerometer": {"unit": "m/s^2", "M": np.eye(3) * 1.01, "b": np.full(3, 0.1)},
            "gyroscope": {"unit": "rad/s", "M": np.eye(3) * 0.99, "b": np.full(3, 0.01)},
        }
    )
    late = np.full(sent, np.nan)
    received, memory = 0, []
    with open_set(words) as units, parse_output("udp://127.0.0.1:9").open(Facts()) as output:
        assert sender.stdin is not None
        sender.stdin.write("go\n")
        sender.stdin.flush()
        began, processor = time.monotonic(), time.process_time()
        look_at, heard = 0, began
        for _, chunk in units:
            now = time.monotonic()
            if len(chunk):
                force, rate = calibration.correct(chunk.accelerometer, chunk.gyroscope)
                output.write(type(chunk)(chunk.time, force, rate))
                if chunk.sensor_time is not None:
                    late[received : received + len(chunk)] = time.monotonic() - chunk.sensor_time
                received += len(chunk)
                heard = now
            if received >= look_at:
                memory.append(_resident())
                look_at += sent // 50
            # Whoever sends to a terminal waits for its reader: it is read until there is no more.
            if received >= sent or now - heard > SILENCE:
                break
        share = (time.process_time() - processor) / (heard - began)
    # Units are decided from the first samples, which therefore wait.
    late = np.sort(late[HEAD_SAMPLES * len(words) : received])
    quantiles = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}
    return {
        "received": received,
        "processor": share,
        "latency": {name: float(np.quantile(late, share)) for name, share in quantiles.items()},
        "largest_latency": float(late[-1]),
        "memory_growth": max(memory[-5:]) / max(memory[5:10]),
    }


class Flood(PolledSource):
    """Samples of a sensor as fast as they are asked for, which arrive as unevenly as over a network."""

    name = "flood"
    remarks: tuple[str, ...] = ()
    gyroscope_unit_is_assumed = False

    def __init__(self, rate: float, samples: int) -> None:
        self._step = 1.0 / rate
        self._left = samples
        self._time = 0.0
        self._generator = np.random.default_rng(1)

    def __enter__(self) -> Flood:
        return self

    def __exit__(self, *error: object) -> None: ...

    def fileno(self) -> None: ...

    def wait(self, longest: float) -> None: ...

    def read(self) -> LiveChunk:
        if self._left <= 0:
            raise EOFError
        self._left -= PIECE
        stamps = self._time + self._step * np.arange(1.0, PIECE + 1.0)
        self._time = float(stamps[-1])
        arrival = self._time + float(self._generator.exponential(1e-3))
        return LiveChunk(stamps, np.ones((PIECE, 3)), np.ones((PIECE, 3)), arrival=arrival)


def flood(hours: float, rate: float) -> Content:
    """Puts so much stream time through a set, as fast as it goes; reports the memory."""
    samples = int(3600.0 * hours * rate)
    done, memory, began = 0, [], time.monotonic()
    look_at = 0
    with LiveSet({"flood": Flood(rate, samples)}) as units:
        for _, chunk in units:
            done += len(chunk)
            if done >= look_at:
                memory.append(_resident())
                look_at += samples // 50
    return {
        "hours": hours,
        "times_real_time": 3600.0 * hours / (time.monotonic() - began),
        "memory_growth": max(memory[-5:]) / max(memory[5:10]),
    }


def _resident() -> int:
    """Bytes of memory that this process holds."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def misses(way: Content) -> list[str]:
    """Describes missed goals."""
    late = [name for name, most in LARGEST_LATENCY.items() if way["latency"][name] > most]
    found = {
        "samples lost": way["lost"] > 0,
        "processor": way["processor"] > LARGEST_SHARE,
        "memory": way["memory_growth"] > LARGEST_GROWTH,
    }
    return [*(name for name, is_missed in found.items() if is_missed), *(f"latency {name}" for name in late)]


def table_of(content: Content) -> Table:
    """Shows what was measured against what is wanted."""
    table = Table(
        "over", "sent", "lost", "cores", "p50 ms", "p99 ms", "p99.9 ms", "largest ms", "memory", "missed"
    )
    for way in content["ways"]:
        latency = [f"{1e3 * way['latency'][name]:.2f}" for name in ("p50", "p99", "p99.9")]
        table.add_row(
            way["over"],
            str(way["sent"]),
            str(way["lost"]),
            f"{way['processor']:.2f}",
            *latency,
            f"{1e3 * way['largest_latency']:.1f}",
            f"{way['memory_growth']:.3f}",
            ", ".join(misses(way)) or "none",
        )
    return table


def main() -> None:
    """Measures and saves."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--units", type=int, default=UNITS)
    parser.add_argument("--rate", type=float, default=RATE)
    parser.add_argument("--over", default=",".join(WAYS))
    parser.add_argument("--hours", type=float, default=HOURS, help="stream time put through for memory")
    parser.add_argument("--no-save", action="store_true", help="show the figures only")
    asked = parser.parse_args()
    ways = [run(over, asked.units, asked.rate, asked.seconds) for over in asked.over.split(",")]
    content: Content = {
        "units": asked.units,
        "rate": asked.rate,
        "seconds": asked.seconds,
        "ways": ways,
        "flood": flood(asked.hours, asked.rate),
        "machine": machine(),
    }
    Console().print(table_of(content))
    long = content["flood"]
    print(
        f"{long['hours']:g} h of stream at {long['times_real_time']:.0f} times real time: memory "
        f"{long['memory_growth']:.3f} times (wanted {LARGEST_GROWTH:g})"
    )
    if not asked.no_save:
        save("live", content)


if __name__ == "__main__":
    main()

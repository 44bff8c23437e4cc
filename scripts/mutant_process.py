"""A program that runs a mutant: it may loop without end, wait for ever, or ask for all memory."""

from __future__ import annotations

import math
import os
import resource
import signal
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

MEMORY = 8 << 30
"""Bytes that a program may ask for."""
TIMES, SECONDS = 10.0, 10.0
"""A program may take so many times what it takes without a fault, and so many seconds besides."""
WAIT = 10.0
"""Wall time at which one that waits is ended, as a multiple of the processor time that it may take."""


@dataclass(frozen=True, slots=True)
class Ended:
    """A program that has ended."""

    code: int
    output: str
    is_over_limit: bool
    processor: float
    """s of processor of it and of all that it started."""


def run(
    command: Sequence[str | Path], folder: Path, environment: Mapping[str, str] = {}, usual: float = math.inf
) -> Ended:
    """Runs a program that usually takes so many seconds of processor, and ends it where it takes too long."""
    limit = TIMES * usual + SECONDS
    before = processor_seconds()
    process = subprocess.Popen(
        command,
        cwd=folder,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
        preexec_fn=None if math.isinf(limit) else lambda: _set_limits(limit),
    )
    is_waiting = False
    try:
        output, _ = process.communicate(timeout=None if math.isinf(limit) else WAIT * limit)
    except subprocess.TimeoutExpired:
        is_waiting = True
        os.killpg(process.pid, signal.SIGKILL)
        output, _ = process.communicate()
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        raise
    is_over = is_waiting or process.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
    return Ended(process.returncode, output, is_over, processor_seconds() - before)


def _set_limits(processor: float) -> None:
    seconds = math.ceil(processor)
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def processor_seconds() -> float:
    """Seconds of processor of all programs that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime

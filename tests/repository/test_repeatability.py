"""Two runs of the tests are the same, on any computer: draws have a seed, no test waits for time to pass."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from hypothesis.internal.conjecture import providers

from repetitions import SOAK
from tumble.tools.simulate.live.ports import PORTS

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
SEEDED = {"default_rng", "SeedSequence", "Random"}
"""Makers of generators, which draw a seed of their own if none is given."""
UNSEEDED = {"SystemRandom", "urandom", "uuid1", "token_bytes", "token_hex", "getrandbits"}
GIVES_SEEDS = ("support/repetitions.py",)
WAITING = {"sleep", "monotonic", "perf_counter", "time_ns", "wait_for_timeout"}
CLOCKS = {"clock", "simulated", "asyncio"}
"""They wait in simulated time: `no_wall_time` of conftest.py holds the clock of the computer to events."""
MAKES_A_CLOCK = ("support/simulated_clock.py", "live/test_simulated_clock.py")
UNSEEDED_RUST = re.compile(r"\b(rand::rng|thread_rng|from_os_rng|from_entropy|OsRng|RandomState)\b")


def calls(source):
    """Calls of a module, each with the name of what is called."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            yield node, getattr(node.func, "attr", getattr(node.func, "id", ""))


def draws_without_a_seed(source):
    """Finds the lines of a module that draw what no seed decides."""
    for node, name in calls(source):
        if name in UNSEEDED or (name in SEEDED and not node.args and not node.keywords):
            yield f"{node.lineno}: {name}"


def waits_for_time(source):
    """Finds the lines of a module that wait for time to pass, or no longer than a time of their own."""
    for node, name in calls(source):
        of = getattr(getattr(node.func, "value", None), "id", "")
        if name in WAITING and of not in CLOCKS:
            yield f"{node.lineno}: {name}"
        for given in node.keywords:
            if given.arg == "timeout" and isinstance(given.value, ast.Constant) and given.value.value:
                yield f"{node.lineno}: timeout={given.value.value}"


def fixed_ports(source):
    """Finds the lines of a module that name a port which a bench may choose, or another test."""
    for number, line in enumerate(source.splitlines(), start=1):
        if any(int(port) in PORTS for port in re.findall(r"(?<![\d.])\d{5}\b", line) if "127.0.0.1" in line):
            yield f"{number}: {line.strip()}"


def found_in_tests(find, but=()):
    return [
        f"{path.relative_to(ROOT)}:{line}"
        for path in sorted(TESTS.rglob("*.py"))
        if path.relative_to(TESTS).as_posix() not in but
        for line in find(path.read_text(encoding="utf-8"))
    ]


def test_no_test_of_python_draws_without_a_seed():
    assert found_in_tests(draws_without_a_seed, GIVES_SEEDS) == []


@pytest.mark.skipif(SOAK, reason="the soak draws anew")
def test_draws_do_not_depend_on_modules_imported_before():
    assert len(providers._get_local_constants()) == 0


def test_no_test_of_python_waits_for_time_to_pass():
    assert found_in_tests(waits_for_time, MAKES_A_CLOCK) == []


def test_no_test_listens_at_a_port_that_others_may_choose():
    assert found_in_tests(fixed_ports) == []
    line = f"listen('127.0.0.1:{PORTS.start}')"
    assert list(fixed_ports(line)) == [f"1: {line}"]


def test_waits_for_time_are_found():
    source = (
        "time.sleep(1)\nclock.sleep(1)\nsleep(2)\nrun(timeout=5)\nrun(timeout=PATIENCE)\ntime.monotonic()\n"
    )
    assert list(waits_for_time(source)) == ["1: sleep", "3: sleep", "4: timeout=5", "6: monotonic"]


def test_draws_without_a_seed_are_found():
    source = (
        "np.random.default_rng()\nrandom.Random(3)\nos.urandom(6)\nSeedSequence().entropy\ndefault_rng(1)\n"
    )
    assert list(draws_without_a_seed(source)) == ["1: default_rng", "3: urandom", "4: SeedSequence"]


def test_no_law_of_rust_draws_without_the_common_seed():
    sources = [path for folder in ("crates", "firmware") for path in sorted((ROOT / folder).rglob("*.rs"))]
    assert len(sources) > 100
    found = [path for path in sources if UNSEEDED_RUST.search(path.read_text(encoding="utf-8"))]
    assert found == []
    assert "PROPTEST_RNG_SEED" in (ROOT / ".cargo" / "config.toml").read_text(encoding="utf-8")

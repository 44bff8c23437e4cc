"""Two runs of the tests are the same: draws have a seed, and no code draws without one."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
SEEDED = {"default_rng", "SeedSequence", "Random"}
"""Makers of generators, which draw a seed of their own if none is given."""
UNSEEDED = {"SystemRandom", "urandom", "uuid1", "token_bytes", "token_hex", "getrandbits"}
GIVES_SEEDS = TESTS / "support" / "repetitions.py"
UNSEEDED_RUST = re.compile(r"\b(rand::rng|thread_rng|from_os_rng|from_entropy|OsRng|RandomState)\b")


def draws_without_a_seed(source):
    """Finds the lines of a module that draw what no seed decides."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        if name in UNSEEDED or (name in SEEDED and not node.args and not node.keywords):
            yield f"{node.lineno}: {name}"


def test_no_test_of_python_draws_without_a_seed():
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in sorted(TESTS.rglob("*.py"))
        if path != GIVES_SEEDS
        for line in draws_without_a_seed(path.read_text(encoding="utf-8"))
    ]
    assert found == []


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

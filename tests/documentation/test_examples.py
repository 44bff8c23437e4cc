"""Every example runs as it stands and ends well."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DEMO = ROOT / "examples/01_turntable.py"
EXAMPLES = sorted(set((ROOT / "examples").glob("*.py")) - {DEMO})


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_in_an_empty_folder(example, tmp_path):
    done = subprocess.run(
        [sys.executable, example], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_demo_fails_the_faulty_target_alone_and_writes_the_report(tmp_path):
    done = subprocess.run(
        [sys.executable, DEMO, tmp_path / "demo"],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    for name in ("target_1", "target_2", "target_3", "target_4"):
        assert f"{name}: Pass" in done.stdout
    assert "target_5: fail: accelerometer scale y" in done.stdout
    assert "4 pass, 1 fail" in done.stdout
    page = (tmp_path / "demo/turntable.html").read_text(encoding="utf-8")
    assert "target_5" in page

"""Files of the working folder are data: no process that computes imports one, whatever its name."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import fleet_functions
from crowded_folder import TUMBLE, crowd
from fleet_jobs import function_job
from patience import PATIENCE

pytestmark = pytest.mark.skipif(
    sys.version_info < (3, 11), reason="Python 3.10 cannot be asked to leave the working folder out"
)
DRAWS = """
from concurrent.futures import ProcessPoolExecutor
from tumble.foundation.workers import WorkerContext, begin

if __name__ == "__main__":
    with ProcessPoolExecutor(1, WorkerContext(), begin) as aside:
        print(aside.submit(abs, -7).result())
"""


def run_in(folder, *words):
    """Runs a program of Python in a folder; returns how it ended."""
    path = {"PYTHONPATH": str(Path(fleet_functions.__file__).parent)}
    return subprocess.run(
        [sys.executable, *map(str, words)],
        cwd=folder,
        env=os.environ | path,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )


@pytest.fixture
def crowded(tmp_path):
    (tmp_path / "crowded").mkdir()
    return crowd(tmp_path / "crowded")


def test_workers_of_a_fleet_import_nothing_from_it(tmp_path, crowded):
    job = tmp_path / "job.json"
    job.write_text(function_job(tmp_path / "results").model_dump_json(exclude_defaults=True))
    ended = run_in(crowded, TUMBLE, "fleet", "run", job, "--workers", 2)
    assert (ended.returncode, "20 inputs" in ended.stdout) == (0, True), ended


def test_processes_that_draw_import_nothing_from_it(tmp_path, crowded):
    program = tmp_path / "draws.py"
    program.write_text(DRAWS)
    ended = run_in(crowded, program)
    assert (ended.returncode, ended.stdout) == (0, "7\n"), ended

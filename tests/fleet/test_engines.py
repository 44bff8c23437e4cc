"""A fleet's results are those of a plain loop, whoever computes them and whatever is lost meanwhile."""

import json
import os
import signal
import subprocess
import sys
from multiprocessing import get_all_start_methods
from multiprocessing.forkserver import _forkserver
from pathlib import Path

import numpy as np
import pytest

import fleet_functions
from fleet_jobs import Gate, LosingEngine, SerialEngine, function_job, results_of, run_job, values_of
from repetitions import repetitions
from tumble.fleet.job import FleetJob
from tumble.fleet.ledger import read_status
from tumble.fleet.local_engine import LocalEngine
from tumble.fleet.places import FileStore
from tumble.foundation.errors import TumbleError
from tumble.laboratory.results import read_results
from turntable_sessions import typed

SUPPORT = Path(fleet_functions.__file__).parent


def expected(seeds):
    """Returns the summaries that a plain loop gives."""
    return sorted(json.dumps(fleet_functions.squared(seed), sort_keys=True) for seed in seeds)


def test_lost_workers_lose_and_double_nothing(tmp_path):
    for seed in range(repetitions(100)):
        job = function_job(tmp_path / str(seed), seeds=(0, 30))
        status = run_job(job, LosingEngine(np.random.default_rng(seed)))
        table = results_of(job)
        told = [text for text in table.column("failure").to_pylist() if text]
        assert table.num_rows == 30, f"seed {seed}"
        assert all("its worker was lost 3 times" in text for text in told), f"seed {seed}"
        # An input that lost three workers by chance is computed by another run.
        assert run_job(job, LosingEngine(np.random.default_rng(seed + 1000)), resume=True).inputs == 30
        assert status.done == 30


def test_tasks_shrink_so_that_no_worker_ends_long_after_others(tmp_path):
    sizes = []

    class NotingEngine(SerialEngine):
        def submit(self, task):
            sizes.append(len(task.inputs))
            return super().submit(task)

    run_job(function_job(tmp_path, seeds=(0, 400), task_seconds=600.0), NotingEngine(slots=2))
    left = 400 - np.cumsum([0, *sizes[:-1]])
    assert sum(sizes) == 400
    assert all(size <= max(4, before // 4) for size, before in zip(sizes, left, strict=True))


@pytest.mark.skipif("forkserver" not in get_all_start_methods(), reason="no server of processes there")
def test_a_killed_server_of_processes_is_one_line_and_resumed(tmp_path, monkeypatch):
    usual, job = _forkserver.ensure_running, function_job(tmp_path, seeds=(0, 4))

    def killed():
        usual()
        os.kill(_forkserver._forkserver_pid, signal.SIGKILL)
        os.waitid(os.P_PID, _forkserver._forkserver_pid, os.WEXITED | os.WNOWAIT)

    with monkeypatch.context() as patch:
        patch.setattr(_forkserver, "ensure_running", killed)
        with pytest.raises(TumbleError, match="no worker can be started"):
            run_job(job, LocalEngine(2))
    run_job(job, resume=True)
    assert values_of(job) == expected(range(4))


def test_input_that_kills_its_worker_is_isolated(tmp_path):
    job = function_job(tmp_path / "results", "deadly")
    status = run_job(job)
    failed = [row for row in results_of(job).to_pylist() if row["failure"]]
    assert [row["place"] for row in failed] == [str(fleet_functions.POISONED)]
    assert "killed by signal 9" in failed[0]["failure"]
    assert (status.done, status.failed) == (20, 1)


def test_killed_workers_change_no_result(tmp_path):
    marks = tmp_path / "marks"
    marks.mkdir()
    job = function_job(tmp_path / "results", "deadly_once", options={"folder": str(marks)})
    status = run_job(job)
    assert values_of(job) == expected(range(20))
    assert status.retried >= 7


@pytest.mark.parametrize("workers", [1, 2])
def test_documents_are_those_of_the_command(tmp_path, logs, workers):
    job = FleetJob(procedure="spin", inputs=f"{logs}/{{lot}}/*.csv", results=str(tmp_path / "results"))
    status = run_job(job, LocalEngine(workers))
    assert (status.done, status.failed) == (5, 1)
    rows = {row["unit"]: row for row in results_of(job).to_pylist()}
    assert "not a log" in rows["broken"]["failure"]
    for unit in ("robot0", "robot3"):
        [log] = logs.glob(f"*/{unit}.csv")
        assert typed("spin", log, "-o", tmp_path / unit).code == 0
        [document] = rows[unit]["documents"]
        assert document["text"] == (tmp_path / unit / document["name"]).read_text()
        assert rows[unit]["lot"] == log.parent.name
        [expected_result] = read_results([tmp_path / unit])
        found = [(each["name"], each["value"], each["u"]) for each in rows[unit]["parameters"]]
        assert found == [(each.name, each.value, each.u) for each in expected_result.parameters]


def test_simulated_recordings_need_no_files(tmp_path):
    job = FleetJob.model_validate(
        {"procedure": "noise", "simulate": {"scenario": "static", "count": 2, "options": {"duration": "60s"}},
         "results": str(tmp_path / "results")}
    )  # fmt: skip
    run_job(job, LosingEngine(np.random.default_rng(0)))
    assert [row["failure"] for row in results_of(job).to_pylist()] == ["", ""]


def test_mistake_in_a_function_is_told_by_input(tmp_path):
    job = function_job(tmp_path / "results", "faulty", seeds=(0, 4))
    run_job(job, LocalEngine(1))
    assert [row["place"] for row in results_of(job).to_pylist() if row["failure"]] == ["2"]


DRIVER = """
from tumble.cli.main import main
from tumble.fleet import driver
driver._LOOK, driver._STATUS_EVERY = 0.01, 0.0
main()
"""
"""The command, which looks after each task at whether its job is cancelled."""


def started(job_file, *more):
    """Starts the command in a process of its own; returns it."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(SUPPORT), *sys.path])}
    command = [sys.executable, "-c", DRIVER, "fleet", "run", str(job_file), "--workers", "1", "-q", *more]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )


def written(folder, job):
    """Writes a job file."""
    path = folder / "job.yaml"
    path.write_text(json.dumps(job.content()))
    return path


def test_killed_driver_goes_on_with_resume(tmp_path):
    gate, folder = Gate(tmp_path), {"folder": str(tmp_path)}
    job = function_job(tmp_path / "results", "held", seeds=(0, 120), options=folder)
    job_file = written(tmp_path, job)
    with started(job_file) as process:
        gate.wait(process)
        process.send_signal(signal.SIGKILL)
    gate.open()
    before = results_of(job).num_rows
    assert 0 < before < 120
    with started(job_file, "--resume") as process:
        assert process.wait() == 0
    assert values_of(job) == expected(range(120))
    assert read_status(FileStore(job.results)).state == "done"


def test_cancel_ends_a_job_that_resume_completes(tmp_path):
    gate, folder = Gate(tmp_path), {"folder": str(tmp_path)}
    job = function_job(tmp_path / "results", "held", seeds=(0, 400), options=folder)
    job_file = written(tmp_path, job)
    with started(job_file) as process:
        gate.wait(process)
        while (done := typed("fleet", "cancel", job_file)).code:
            assert process.poll() is None, done.err
        gate.open()
        assert process.wait() == 130, process.communicate()
    shown = json.loads(typed("fleet", "status", job_file, "--json").out)
    assert shown["verdict"] == "cancelled"
    assert 0 < shown["done"] < 400

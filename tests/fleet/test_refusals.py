"""Wrong jobs, inputs and stores end in one line, and results of before stay as they are."""

import json
import random
import socket
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import typer

from fleet_jobs import LosingEngine, SerialEngine, function_job, results_of, run_job
from repetitions import drawn_seed, few, repetitions
from tumble.cli.commands import command_line_for
from tumble.cli.live_options import LIVE
from tumble.fleet import ray_engine
from tumble.fleet.input_options import READ, options_of_inputs
from tumble.fleet.inputs import FleetInput, InputList, InputsError
from tumble.fleet.job import FleetJob, option_words
from tumble.fleet.lease import driver_lease
from tumble.fleet.local_engine import LocalEngine
from tumble.fleet.places import FileStore
from tumble.fleet.task import FleetTask, OtherVersionError, run_task
from tumble.foundation.errors import TumbleError
from tumble.foundation.procedures import PROCEDURES
from turntable_sessions import one_line, typed


def refused(job, tmp_path, *more):
    """Returns the line with which a job is refused."""
    path = tmp_path / "job.yaml"
    path.write_text(job if isinstance(job, str) else json.dumps(job))
    done = typed("fleet", "run", path, *more)
    assert done.code == 2, f"{done.code}: {done.out}{done.err}"
    return one_line(done.err)


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        ({"procedure": "spinn", "inputs": "*.csv", "results": "r"}, "procedure 'spinn' is unknown"),
        ({"procedure": "spin", "results": "r"}, "needs one of inputs, simulate and seeds"),
        ({"procedure": "spin", "inputs": "*.csv", "results": ""}, "results is empty"),
        ({"procedure": "turntable", "inputs": "*", "results": "r"}, "takes several logs; give arguments"),
        ({"procedure": "spin", "seeds": {"count": 3}, "results": "r"}, "seeds are for a function"),
        ({"procedure": "spin", "input": "*.csv", "results": "r"}, "did you mean 'inputs'?"),
        ({"procedure": "spin", "inputs": "nothing/*.csv", "results": "r"}, "fits no file"),
        ({"procedure": "spin", "inputs": "nothing/{town}/*", "results": "r"}, "{town} is unknown"),
        ({"procedure": "spin", "inputs": "ftpx://a/*", "results": "r"}, "give a folder or an s3:// URL"),
        ("procedure: [", "correct the YAML there"),
    ],
)
def test_wrong_job_is_one_line(tmp_path, monkeypatch, content, cause):
    monkeypatch.chdir(tmp_path)
    assert cause in refused(content, tmp_path)


@pytest.mark.parametrize(
    ("columns", "cause"),
    [
        ({"file": ["a.csv"]}, "has no column place"),
        ({"place": ["a.csv", None]}, "row 2: place is empty"),
        ({"place": ["a.csv", "b.csv"]}, "row 2: b.csv does not exist"),
        ({"place": ["a.csv", "a.csv"]}, "a.csv: is given twice"),
        ({"place": ["a.csv"], "options": ["still"]}, "row 1: options 'still' are no JSON object"),
        ({"place": pa.array([], pa.string())}, "lists no inputs"),
        ({"place": ["a.csv"], "day": ["yesterday"]}, "row 1: day 'yesterday' is none"),
        ({"place": ["a.csv"], "day": ["2999-01-01"]}, "row 1: day '2999-01-01' is in the future"),
        ({"place": ["a.csv"], "unit": ["x" * 2000]}, "row 1: unit: a name of 2000 letters"),
    ],
)
def test_wrong_manifest_names_row_and_cause(tmp_path, monkeypatch, columns, cause):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text("")
    pq.write_table(pa.table(columns), "units.parquet")
    with pytest.raises(InputsError) as error:
        InputList(FleetJob(procedure="spin", inputs="units.parquet", results="r"))
    assert cause in str(error.value)


def options_of(procedure):
    """Returns the options of a procedure by name without `--`."""
    parameters = command_line_for([procedure]).commands[procedure].params
    return {
        name[2:]: each
        for each in parameters
        for name in (*each.opts, *each.secondary_opts)
        if name.startswith("--")
    }


@pytest.mark.parametrize("procedure", [each.word for each in PROCEDURES])
def test_no_option_of_a_manifest_names_a_place_to_write(tmp_path, monkeypatch, procedure):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text("")
    known = options_of(procedure)
    written = {name for name, each in known.items() if takes_a_path(each)} - READ
    assert {"output", "rerun", "mcap"} <= written
    forms = {"help", "o", "rer", "rerun=x.rrd", "", "a b", "RERUN", "--rerun", "registry"}
    live = {name for name, each in known.items() if each.rich_help_panel == LIVE}
    arguments = "a b {input}"
    job = FleetJob(procedure=procedure, inputs="units.parquet", results="r", arguments=arguments)
    for name in sorted(written | forms | live):
        options = json.dumps({name: str(tmp_path / "PWN")})
        pq.write_table(pa.table({"place": ["a.csv"], "options": [options]}), "units.parquet")
        with pytest.raises(InputsError, match=r"row 1: option .* none that a manifest may state"):
            InputList(job)
    for name in sorted(known.keys() & (READ | {"serial", "rate"})):
        pq.write_table(pa.table({"place": ["a.csv"], "options": [json.dumps({name: "x"})]}), "units.parquet")
        assert [each.options for each in InputList(job)] == [{name: "x"}]


@pytest.mark.parametrize("procedure", [each.word for each in PROCEDURES])
def test_no_value_of_a_manifest_is_another_option(tmp_path, monkeypatch, procedure):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "--mcap=a.csv").write_text("")
    job = FleetJob(procedure=procedure, inputs="units.parquet", results="r", arguments="{input}")
    hostile = [
        "--mcap=x",
        "-ox",
        True,
        "x y",
        -40,
        0.5,
        None,
        {"--mcap": "x"},
        [True, "--mcap=x"],
        ["a", "-o"],
    ]
    for name in sorted(options_of_inputs(procedure)):
        for value in few(hostile, 4):
            table = {"place": ["--mcap=a.csv"], "options": [json.dumps({name: value})]}
            pq.write_table(pa.table(table), "units.parquet")
            refusal, given = "", FleetInput("")
            try:
                (given,) = InputList(job)
            except InputsError as error:
                refusal = str(error)
            if refusal:
                assert f"option {name!r} takes" in refusal
                continue
            words = [*job.words(given.place), *option_words(given.options)]
            assert words[:2] == [procedure, "./--mcap=a.csv"]
            assert all(word == f"--{name}" or word.startswith(f"--{name}=") for word in words[2:])


def takes_a_path(option):
    """Returns whether the value of an option becomes a path."""
    return isinstance(option.type, typer.models.TyperPath) or option.metavar == "DIR"


def test_no_file_of_the_results_holds_a_password(tmp_path, logs):
    secret = "postgresql://tumble:hunter2secret@127.0.0.1:9/lab"
    options = {"registry": secret, "still": "2s"}
    job = FleetJob(
        procedure="spin",
        inputs=[str(logs / "lot0" / "robot0.csv")],
        options=options,
        results=str(tmp_path / "results"),
    )
    run_job(job, SerialEngine())
    assert all(b"hunter2secret" not in content for content in content_of(tmp_path / "results").values())
    another = job.model_copy(update={"options": options | {"still": "3s"}})
    with pytest.raises(TumbleError, match="other options"):
        run_job(another, SerialEngine(), resume=True)


def test_a_command_that_prints_no_result_is_a_failure_by_name(tmp_path, logs):
    log = str(logs / "lot0" / "robot0.csv")
    job = FleetJob(procedure="spin", inputs=[log], options={"help": True}, results=str(tmp_path / "results"))
    run_job(job, SerialEngine())
    (found,) = results_of(job).to_pylist()
    assert found["failure"] == "spin: printed no result; leave out --help and its like"


def test_resume_refuses_changed_options_and_keeps_results(tmp_path):
    job = function_job(tmp_path / "results", seeds=(0, 3))
    run_job(job, LosingEngine(np.random.default_rng(0)))
    before = {path: path.read_bytes() for path in (tmp_path / "results").rglob("*") if path.is_file()}
    other = function_job(tmp_path / "results", seeds=(0, 3), options={"offset": 1}).content()
    assert "another procedure or other options" in refused(other, tmp_path, "--resume")
    assert "go on with --resume" in refused(job.content(), tmp_path)
    assert before == {path: path.read_bytes() for path in before}


def test_worker_of_another_version_ends_the_job():
    job = function_job("results")
    with pytest.raises(OtherVersionError, match="install the same version on all nodes"):
        run_task(FleetTask(job, (FleetInput("0"),), "0", "0.0.1"))


@pytest.mark.parametrize("unreachable", ["inputs", "results"])
def test_unreachable_store_is_one_line_without_credentials(tmp_path, monkeypatch, unreachable):
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "someone")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "hunter2secret")
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    (tmp_path / "log.csv").write_text("")
    places = {"inputs": str(tmp_path / "*.csv"), "results": str(tmp_path / "r")}
    line = refused({"procedure": "spin", **places, unreachable: "s3://fleet/robots.csv"}, tmp_path)
    assert "cannot be reached" in line
    assert "hunter2secret" not in line
    assert "someone" not in line


@pytest.fixture
def results(tmp_path):
    """Returns a folder with results of three inputs."""
    run_job(function_job(tmp_path / "results", seeds=(0, 3)), LosingEngine(np.random.default_rng(0)))
    return tmp_path / "results"


def content_of(folder):
    """Returns the content of all files of a folder."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def manifest_job(folder, places):
    """Returns a job over a manifest, whose options are those of the results of before."""
    pq.write_table(pa.table({"place": places}), folder / "units.parquet")
    return {"procedure": "spin", "inputs": str(folder / "units.parquet"), "results": str(folder / "spins")}


@pytest.mark.parametrize(
    ("places", "cause"),
    [(["log.csv", "log.csv"], "is given twice"), (["log.csv", "gone.csv"], "row 2: gone.csv does not exist")],
)
def test_wrong_manifest_leaves_results_of_before(tmp_path, monkeypatch, logs, places, cause):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_bytes((logs / "lot0" / "robot0.csv").read_bytes())
    run_job(FleetJob(**manifest_job(tmp_path, ["log.csv"])), LocalEngine(1))
    before = content_of(tmp_path / "spins")
    assert cause in refused(manifest_job(tmp_path, places), tmp_path, "--resume")
    assert content_of(tmp_path / "spins") == before
    # A job that was refused before it began leaves nothing, so that it may begin once it is corrected.
    fresh = manifest_job(tmp_path, places) | {"results": "fresh"}
    assert cause in refused(fresh, tmp_path)
    assert not (tmp_path / "fresh").exists()


def test_unreachable_cluster_leaves_results_of_before(tmp_path, results):
    before = content_of(results)
    job = function_job(results, seeds=(0, 9)).content()
    line = refused(job, tmp_path, "--resume", "--engine", "ray:someone:hunter2secret@127.0.0.1:9")
    assert "cannot be reached" in line
    assert "hunter2secret" not in line
    assert content_of(results) == before


def answer_of_no_cluster(chance):
    """Draws what something that is no cluster sends before it is silent."""
    noise = chance.randbytes(chance.randrange(2, 200))
    return chance.choice(
        [b"", noise[:1], b"HTTP/1.1 400 Bad Request\r\n\r\n", bytes(3) + b"\5" + noise + noise]
    )


def test_whatever_is_no_cluster_is_refused_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr(ray_engine, "_ANSWERS_WITHIN", 0.05)
    chance = random.Random(drawn_seed())
    job = function_job(tmp_path / "results", seeds=(0, 9)).content()
    for _ in range(repetitions(40)):
        with socket.create_server(("127.0.0.1", 0)) as listening, ThreadPoolExecutor(1) as aside:
            aside.submit(answer_once, listening, answer_of_no_cluster(chance))
            place = f"ray:127.0.0.1:{listening.getsockname()[1]}"
            assert "cannot be reached" in refused(job, tmp_path, "--engine", place)


def answer_once(listening, answer):
    """Answers whoever comes first, and waits until they have gone."""
    line, _ = listening.accept()
    with line, suppress(ConnectionError):
        line.sendall(answer)
        while line.recv(1 << 12):
            pass


class OtherVersionEngine(LosingEngine):
    """Engine whose workers have another version of Tumble."""

    def _outcome(self, task):
        try:
            return run_task(replace(task, software="0.0.1"))
        except OtherVersionError as error:
            return error


def test_node_of_another_version_leaves_results_of_before(tmp_path, results, monkeypatch):
    engine = OtherVersionEngine(np.random.default_rng(0))
    monkeypatch.setattr("tumble.fleet.engine.engine_of", lambda *_: engine)
    before = content_of(results / "parts")
    job = function_job(results, seeds=(0, 9)).content()
    assert "install the same version on all nodes" in refused(job, tmp_path, "--resume")
    assert content_of(results / "parts") == before


def test_second_driver_of_a_folder_is_refused(tmp_path, results):
    before = content_of(results)
    with driver_lease(FileStore(str(results))):
        line = refused(function_job(results, seeds=(0, 9)).content(), tmp_path, "--resume")
    assert "another run" in line
    assert content_of(results) == before


def test_resumed_job_counts_failures_of_before(tmp_path):
    job = function_job(tmp_path / "results", "faulty", seeds=(0, 4))
    run_job(job, LosingEngine(np.random.default_rng(1)))
    more = function_job(tmp_path / "results", "faulty", seeds=(0, 6))
    status = run_job(more, LosingEngine(np.random.default_rng(1)), resume=True)
    assert (status.done, status.failed, status.not_well) == (6, 1, 0)

"""Recordings and results on S3 give the results of files, also where a call now and then fails."""

import random

import boto3
import numpy as np
import pytest
from moto.server import ThreadedMotoServer
from s3fs import S3FileSystem

from fleet_jobs import LosingEngine, results_of, run_job
from tumble.fleet.job import FleetJob
from tumble.fleet.places import FileStore


@pytest.fixture(scope="module")
def bucket(logs):
    """Serves an S3 bucket with the logs of the fleet."""
    # Whoever was opened before keeps the address of another server.
    S3FileSystem.clear_instance_cache()
    server = ThreadedMotoServer("127.0.0.1", 0)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {
            "AWS_ENDPOINT_URL": f"http://{host}:{port}",
            "AWS_ACCESS_KEY_ID": "test",
            "AWS_SECRET_ACCESS_KEY": "test",
            "AWS_DEFAULT_REGION": "us-east-1",
        }.items():
            patch.setenv(name, value)
        client = boto3.client("s3")
        client.create_bucket(Bucket="fleet")
        for path in sorted(logs.rglob("*.csv")):
            client.upload_file(str(path), "fleet", f"logs/{path.parent.name}/{path.name}")
        yield "s3://fleet"
    server.stop()


def of_content(job):
    """Returns the columns of results that do not depend on where they lie."""
    names = ["unit", "lot", "serial", "verdict", "summary", "parameters", "documents"]
    return sorted((row["unit"], row) for row in results_of(job).select(names).to_pylist())


def job_at(place, results):
    """Returns a job over the logs at a place."""
    return FleetJob(procedure="spin", inputs=f"{place}/logs/{{lot}}/*.csv", results=results)


def test_results_on_s3_are_those_of_files(bucket, logs, tmp_path):
    local = job_at(logs.parent, str(tmp_path / "results"))
    remote = job_at(bucket, f"{bucket}/results")
    for job in (local, remote):
        status = run_job(job, LosingEngine(np.random.default_rng(1)))
        assert (status.inputs, status.done) == (5, 5)
    assert of_content(remote) == of_content(local)


def test_calls_that_fail_now_and_then_change_nothing(bucket, logs, tmp_path, monkeypatch):
    draws = random.Random(7)
    store = type(FileStore(bucket).files)
    whole = store.get

    def get(self, *arguments, **options):
        if draws.random() < 0.2:
            raise OSError("please reduce your request rate")
        return whole(self, *arguments, **options)

    monkeypatch.setattr(store, "get", get)
    job = job_at(bucket, str(tmp_path / "results"))
    run_job(job, LosingEngine(np.random.default_rng(2)))
    assert [row["place"] for row in results_of(job).to_pylist() if row["failure"]] == [
        "s3://fleet/logs/lot0/broken.csv"
    ]

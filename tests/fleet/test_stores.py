"""Recordings and results on S3 give the results of files, also where a call now and then fails."""

import json
import random

import boto3
import numpy as np
import pytest
from moto import settings
from moto.core.responses import ActionAuthenticatorMixin
from s3fs import S3FileSystem

from fleet_jobs import LosingEngine, function_job, results_of, run_job, values_of
from s3_servers import s3_server
from tumble.fleet.job import FleetJob
from tumble.fleet.lease import KIND, LEASE_FILE, OtherDriverError, driver_lease
from tumble.fleet.places import FileStore
from tumble.foundation import clock
from turntable_sessions import one_line, typed


@pytest.fixture(scope="module")
def bucket(logs):
    """Serves an S3 bucket with the logs of the fleet."""
    with s3_server():
        client = boto3.client("s3")
        client.create_bucket(Bucket="fleet")
        for path in sorted(logs.rglob("*.csv")):
            client.upload_file(str(path), "fleet", f"logs/{path.parent.name}/{path.name}")
        yield "s3://fleet"


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
    whole = S3FileSystem.get_file

    def get(self, *arguments, **options):
        if draws.random() < 0.2:
            raise OSError("please reduce your request rate")
        return whole(self, *arguments, **options)

    monkeypatch.setattr(S3FileSystem, "get_file", get)
    job = job_at(bucket, str(tmp_path / "results"))
    run_job(job, LosingEngine(np.random.default_rng(2)))
    assert [row["place"] for row in results_of(job).to_pylist() if row["failure"]] == [
        "s3://fleet/logs/lot0/broken.csv"
    ]


def test_wrong_credentials_are_one_line_that_holds_none(bucket, tmp_path, monkeypatch):
    job = function_job(f"{bucket}/refused", seeds=(0, 3))
    run_job(job, LosingEngine(np.random.default_rng(0)))
    before = values_of(job)
    path = tmp_path / "job.yaml"
    path.write_text(json.dumps(job.content()))
    with monkeypatch.context() as patch:
        patch.setenv("AWS_ACCESS_KEY_ID", "SOMEONE1234567890")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "hunter2secret")
        # From here on the server asks who calls.
        patch.setattr(settings, "INITIAL_NO_AUTH_ACTION_COUNT", 0)
        patch.setattr(ActionAuthenticatorMixin, "request_count", 1)
        S3FileSystem.clear_instance_cache()
        done = typed("fleet", "run", path, "--resume")
        assert done.code == 2
        line = one_line(done.err)
        assert "check the address, network and credentials" in line
        assert "hunter2secret" not in line
        assert "SOMEONE1234567890" not in line
    S3FileSystem.clear_instance_cache()
    assert values_of(job) == before


def test_second_driver_waits_for_a_lease_that_is_renewed(bucket, simulated_clock):
    results = FileStore(f"{bucket}/leased")
    job = function_job(results.url, seeds=(0, 3))
    with driver_lease(results), pytest.raises(OtherDriverError, match="another driver"):
        run_job(job, LosingEngine(np.random.default_rng(0)))
    # A driver that was killed leaves its lease, which nobody renews.
    results.write(LEASE_FILE, b"0123 7 host process 1", KIND)
    assert run_job(job, LosingEngine(np.random.default_rng(0))).done == 3
    assert results.read(LEASE_FILE) is None


def test_driver_whose_lease_was_taken_ends(bucket, simulated_clock):
    results = FileStore(f"{bucket}/taken")
    with driver_lease(results) as held:
        results.write(LEASE_FILE, b"0123 1 host process 1", KIND)
        clock.sleep(5.0)
        with pytest.raises(OtherDriverError, match="host process 1"):
            held.check()
    assert results.read(LEASE_FILE) == b"0123 1 host process 1"

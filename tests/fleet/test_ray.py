"""A job on two nodes of Ray: as the how-to has it, with S3, and while a node goes."""

import json
import os
import re
import sys
import threading
from pathlib import Path

import boto3
import pytest
from ray.cluster_utils import Cluster

import fleet_functions
from fleet_jobs import Gate, function_job, run_job, values_of
from s3_servers import s3_server
from tumble.fleet.ray_engine import RayEngine
from tumble.fleet.ray_messages import LISTENER, RayMessages
from turntable_sessions import typed

ROOT = Path(__file__).parent.parent.parent
PAGE = (ROOT / "docs" / "how-to" / "fleet.md").read_text()


@pytest.fixture(scope="module")
def cluster():
    """Begins a cluster of two nodes with a processor each, beside a server of S3 that both know."""
    paths = os.pathsep.join([str(Path(fleet_functions.__file__).parent), *sys.path])
    with s3_server(), pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", paths)
        nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
        second = nodes.add_node(num_cpus=1)
        patch.setenv("RAY_ADDRESS", nodes.address)
        yield nodes, second
        nodes.shutdown()


def test_commands_of_the_how_to_run_on_two_nodes_with_s3(cluster, tmp_path, monkeypatch):
    store = boto3.client("s3")
    for bucket in ("fleet", "fleet-results"):
        store.create_bucket(Bucket=bucket)
    for seed in (1, 2):
        made = tmp_path / str(seed)
        assert typed("simulate", "spin", "-o", made, "--seed", seed, "--format", "mcap").code == 0
        store.upload_file(str(made / "spin.mcap"), "fleet", f"2026-11-0{seed}/robot-{seed}/imu.mcap")
    monkeypatch.chdir(tmp_path)
    [job] = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    Path("s3-job.yaml").write_text(job)
    lines = re.findall(r"^    tumble (.*)$", PAGE, re.MULTILINE)
    assert len(lines) == 2
    done = [typed(*line.split(), "--json") for line in lines]
    assert [each.code for each in done] == [0, 0], done
    summary, status = (json.loads(each.out) for each in done)
    assert summary["verdicts"] == {"calibrated": 2}
    assert (status["verdict"], status["done"], status["engine"]) == ("done", 2, "ray")


def test_ray_prints_nothing_among_the_output_of_a_command(capsys):
    messages = RayMessages()
    printing = threading.Thread(target=print, args=("(raylet) The node went",), name=LISTENER)
    printing.start()
    printing.join()
    print("{}")
    with messages.dropped_here():
        print("(raylet) The node went")
    messages.close()
    assert capsys.readouterr().out == "{}\n"


def test_removed_node_loses_and_doubles_nothing(cluster, tmp_path, capsys):
    nodes, second = cluster
    gate = Gate(tmp_path)
    job = function_job(tmp_path / "results", "held", seeds=(0, 150), options={"folder": str(tmp_path)})

    def remove():
        gate.wait()
        nodes.remove_node(second, allow_graceful=False)
        gate.open()

    removal = threading.Thread(target=remove)
    removal.start()
    status = run_job(job, RayEngine("", 2))
    removal.join()
    assert (status.done, status.failed) == (150, 0)
    expected = [json.dumps(fleet_functions.squared(seed), sort_keys=True) for seed in range(150)]
    assert values_of(job) == sorted(expected)
    assert capsys.readouterr().out == ""

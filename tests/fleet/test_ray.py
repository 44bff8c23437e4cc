"""A job goes on while nodes of a cluster of Ray go, and gives what a plain loop gives."""

import json
import os
import sys
import threading
from pathlib import Path

import pytest
import ray
from ray.cluster_utils import Cluster

import fleet_functions
from fleet_jobs import function_job, run_job, values_of
from tumble.fleet.ray_engine import RayEngine


@pytest.fixture
def cluster():
    """Begins a cluster of two nodes with a processor each."""
    nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    second = nodes.add_node(num_cpus=1)
    paths = os.pathsep.join([str(Path(fleet_functions.__file__).parent), *sys.path])
    ray.init(nodes.address, log_to_driver=False, runtime_env={"env_vars": {"PYTHONPATH": paths}})
    yield nodes, second
    ray.shutdown()
    nodes.shutdown()


def test_removed_node_loses_and_doubles_nothing(cluster, tmp_path):
    nodes, second = cluster
    job = function_job(tmp_path / "results", "slow", seeds=(0, 150))
    removal = threading.Timer(3.0, lambda: nodes.remove_node(second, allow_graceful=False))
    removal.start()
    status = run_job(job, RayEngine("", 2))
    removal.join()
    assert (status.done, status.failed) == (150, 0)
    expected = [json.dumps(fleet_functions.squared(seed), sort_keys=True) for seed in range(150)]
    assert values_of(job) == sorted(expected)

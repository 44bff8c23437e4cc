"""A cluster of Ray with two nodes of one processor each on this machine, the second of which can be killed."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import psutil


class TwoNodes:
    """Two nodes; `address` is where the cluster is reached."""

    def __init__(self) -> None:
        from ray.cluster_utils import Cluster

        # Workers import the benchmarks from where this process does.
        os.environ["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
        self._nodes: Any = Cluster(
            initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False}
        )
        self._second: Any = self._nodes.add_node(num_cpus=1)
        self.address: str = self._nodes.address

    def replace_second(self) -> None:
        """Kills the second node at once with all that it computes, and adds another one."""
        [raylet] = self._second.all_processes["raylet"]
        workers = psutil.Process(raylet.process.pid).children(recursive=True)
        for worker in workers:
            # A worker that outlived its node for some seconds could finish its task.
            with suppress(psutil.NoSuchProcess):
                worker.kill()
        self._nodes.remove_node(self._second, allow_graceful=False)
        self._second = self._nodes.add_node(num_cpus=1)

    def close(self) -> None:
        """Ends all nodes."""
        self._nodes.shutdown()


@contextmanager
def two_nodes() -> Iterator[TwoNodes]:
    """Gives two nodes while the block runs, to which this process is connected."""
    import ray

    nodes = TwoNodes()
    try:
        ray.init(nodes.address, log_to_driver=False)
        yield nodes
    finally:
        ray.shutdown()
        nodes.close()

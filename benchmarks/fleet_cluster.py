"""A cluster of Ray on this machine: two nodes of one processor each, the second of which can be killed."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import psutil  # type: ignore[import-untyped]


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

    def workers(self) -> list[psutil.Process]:
        """Returns the processes that compute a task just now."""
        nodes = [self._nodes.head_node, self._second]
        return [each for node in nodes for each in _children(node) if _computes(each)]

    def replace_second(self) -> None:
        """Kills the second node at once with all that it computes, and adds another one."""
        for worker in _children(self._second):
            # A worker that outlived its node for some seconds could finish its task.
            with suppress(psutil.NoSuchProcess):
                worker.kill()
        self._nodes.remove_node(self._second, allow_graceful=False)
        self._second = self._nodes.add_node(num_cpus=1)

    def close(self) -> None:
        """Ends all nodes."""
        self._nodes.shutdown()


def _children(node: Any) -> list[psutil.Process]:  # noqa: ANN401 - Ray's types are its own
    """Returns all processes that a node has started."""
    [raylet] = node.all_processes["raylet"]
    found: list[psutil.Process] = psutil.Process(raylet.process.pid).children(recursive=True)
    return found


def _computes(process: psutil.Process) -> bool:
    try:
        return any("ray::run_task" in word for word in process.cmdline())
    except psutil.Error:
        return False


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

"""Runs jobs of a fleet in tests, also by an engine that loses workers at random."""

import os
import selectors

import fleet_functions
from tumble.fleet.driver import FleetRun
from tumble.fleet.engine import Finished, WorkerLostError
from tumble.fleet.job import FleetJob
from tumble.fleet.local_engine import LocalEngine
from tumble.fleet.parts import whole_table
from tumble.fleet.places import FileStore
from tumble.fleet.task import run_task


def function_job(results, name="squared", seeds=(0, 20), **more):
    """Returns a job that calls a function of `fleet_functions`."""
    return FleetJob.model_validate(
        {
            "procedure": f"fleet_functions:{name}",
            "seeds": {"first": seeds[0], "count": seeds[1] - seeds[0]},
            "results": str(results),
            "task_seconds": 0.05,
            **more,
        }
    )


def run_job(job, engine=None, *, resume=False):
    """Runs a job to its end."""
    return FleetRun(job, lambda: engine or LocalEngine(2), "local", resume).run()


def results_of(job):
    """Returns all results, in the order of their keys."""
    return whole_table(FileStore(job.results))


def values_of(job):
    """Returns the summaries of all results, as text, sorted."""
    return sorted(results_of(job).column("summary").to_pylist())


class Gate:
    """Holds a job of `fleet_functions.held` in its midst."""

    def __init__(self, folder):
        self._comes = folder / fleet_functions.COMES
        goes = folder / fleet_functions.GOES
        for pipe in (self._comes, goes):
            os.mkfifo(pipe)
        self._came, self._go = (os.open(pipe, os.O_RDWR) for pipe in (self._comes, goes))

    def wait(self, process=None):
        """Waits until a worker has come; a process that runs the job must not end before."""
        with selectors.DefaultSelector() as ends:
            ends.register(self._came, selectors.EVENT_READ)
            if process is not None:
                ends.register(process.stderr, selectors.EVENT_READ)
            assert self._came in {key.fd for key, _ in ends.select()}, process.communicate()

    def open(self):
        """Lets all workers go on."""
        self._comes.unlink()
        os.write(self._go, 1000 * b".")


class SerialEngine:
    """Computes in this process, one task after another."""

    def __init__(self, slots=1):
        self.slots = slots
        self._waiting = []
        self._next = 0

    def submit(self, task):
        self._next += 1
        self._waiting.append((self._next, task))
        return self._next

    def finished(self, seconds):
        number, task = self._waiting.pop(self._chosen(len(self._waiting)))
        yield Finished(number, task, self._outcome(task))

    def close(self):
        self._waiting.clear()

    def _chosen(self, waiting):
        return 0

    def _outcome(self, task):
        return run_task(task)


class LosingEngine(SerialEngine):
    """Takes tasks in any order; loses a worker before or after its work."""

    def __init__(self, loses, slots=3):
        super().__init__(slots)
        self._loses = loses

    def _chosen(self, waiting):
        return self._loses.choice(waiting)

    def _outcome(self, task):
        before, after = self._loses.random(2) < 0.2
        outcome = WorkerLostError("killed") if before else super()._outcome(task)
        # A worker may die when its results are written already: they are then written twice.
        return WorkerLostError("killed") if after else outcome

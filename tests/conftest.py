"""Number of test processes (`pytest --numprocesses auto`), tests that share one, and settings of all
tests.
"""

from __future__ import annotations

import gc
import os
import signal
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers

from going_on import GoingOn
from ports import chosen_among_own
from processor_time import ProcessorTime
from repetitions import SOAK, repetitions
from simulated_clock import DATE, ComputerClock, SimulatedClock
from tumble.foundation import clock
from tumble.foundation.ending import ENDING

# The duration of an example depends on the load of the computer.
settings.register_profile(
    "tumble",
    deadline=None,
    derandomize=not SOAK,
    print_blob=True,
    max_examples=repetitions(settings.default.max_examples),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("tumble")
if not SOAK:
    # Draws hold constants of all modules that were imported before, which depend on the order of the tests.
    providers.is_local_module_file = lambda _path: False

# Programs that tests end by signals inherit those that a shell ignores for what it runs in the background.
signal.signal(signal.SIGINT, signal.default_int_handler)
for ignored in ENDING - {signal.SIGPIPE, signal.SIGXFSZ}:
    if signal.getsignal(ignored) is signal.SIG_IGN:
        signal.signal(ignored, signal.SIG_DFL)

# Tests read what commands write in a tenth of the time that PyYAML takes without libyaml.
yaml.SafeLoader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

# Tests read English, whatever the language of the machine.
os.environ["TUMBLE_LANG"] = "en"

# All that tests make, in any process and at any time, bears one date.
os.environ["SOURCE_DATE_EPOCH"] = str(DATE)

DEVICE = Path(__file__).parent.name + "/device/"
LONG = (DEVICE, "/test_live", "/test_ray", "/test_examples")
"""Parts of the names of files whose tests take long, those that take longest first."""
BENCH, BEFORE = "/bench/", "/turntable"
"""Tests with a browser, and the folder before which they come: late, for those of the device compile on all
cores, and not last, for they leave a core idle."""
LONG_AT_BENCH = tuple(
    f"{BENCH}test_{name}.py" for name in ("session", "guided_runs", "interruptions", "viewers")
)
"""Those that take long, which begin before the rest of them."""


# The modules and tests of a process stay until its end: to look for garbage among them takes a third of the
# time of collecting tests, and half a minute at the end.
gc.disable()


def pytest_configure(config):
    config.pluginmanager.register(ProcessorTime())
    config.pluginmanager.register(GoingOn())


def pytest_collection_finish():
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def own_ports():
    """Two processes that run tests choose different ports."""
    with chosen_among_own():
        yield


@pytest.fixture(scope="session", autouse=True)
def no_wall_time():
    """No test waits until time has passed, but in `make soak`."""
    with clock.replaced_by(clock.Clock() if SOAK else ComputerClock()):
        yield


@pytest.fixture
def computer_clock():
    """The clock of the computer as it is, for libraries of others that find one another in its time."""
    with clock.replaced_by(clock.Clock()):
        yield


@pytest.fixture
def simulated_clock():
    """A clock whose time passes only while the test, and all that it starts, wait."""
    with SimulatedClock() as simulated:
        yield simulated


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """One process more than cores, for those that wait; each takes over a gigabyte."""
    return 1 + (os.cpu_count() or 1)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Each process begins with another folder, and finds compiled what the others began with."""
    report = yield
    if collector.path == Path(__file__).parent and (worker := getattr(collector.config, "workerinput", None)):
        share = int(worker["workerid"].removeprefix("gw")) / worker["workercount"]
        first = int(share * len(report.result))
        report.result = report.result[first:] + report.result[:first]
    return report


def pytest_collection_modifyitems(items):
    """Long files begin first, lest one process ends with them alone; all processes have one order."""

    def order(item):
        file = item.nodeid.partition("::")[0]
        return (
            next((place for place, part in enumerate(LONG) if part in file), len(LONG)),
            file.partition("/")[0] + BEFORE if BENCH in file else file,
            not file.endswith(LONG_AT_BENCH),
            file,
        )

    items.sort(key=order)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Keeps tests of a file together, as they share what they simulate, and all that builds for the device.

    That shares folders under `target`: one test goes after the other, beside all others, so that none
    takes a library that another has just built for something else.
    """
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return DEVICE if nodeid.startswith(DEVICE) else super()._split_scope(nodeid)

    # By default files of many tests come first, not those that take long.
    config.option.loadscopereorder = False
    return Scheduling(config, log)

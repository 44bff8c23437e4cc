"""Whatever befalls units, disk or program: a live procedure ends in words, and finds nothing wrong."""

from __future__ import annotations

import socket
from types import SimpleNamespace

import numpy as np
import pytest

from killed_commands import filled, killed_on_bench
from live_benches import simulated_bench
from live_procedures import LIVE, samples_in
from repetitions import SOAK
from simulated_clock import BEGINS
from tumble.foundation.errors import OutputError
from tumble.tools.record.parts import UnitParts
from tumble.tools.simulate import LiveFault
from tumble.tools.simulate.live.scenario import LiveScenario
from typed_commands import typed

DRAWS = 30 if SOAK else 1
KINDS = ("unplugged", "garbled", "restart", "frozen", "gap", "late", "clock-jump", "time-backwards")
FEW = {
    "record": ("unplugged",),
    "spin": ("garbled",),
    "apply": ("clock-jump",),
    "turntable": ("clock-jump",),
    "multipose": ("frozen",),
    "redundancy": ("restart",),
}
"""Faults that `make test` draws."""
CASES = [(name, kind) for name in LIVE for kind in (KINDS if SOAK else FEW.get(name, ()))]
RECORDING = [name for name, row in LIVE.items() if row.session]
TURNED = "turntable that turns its table"
KILLED, FULL = ([name for name in RECORDING if SOAK or name != other] for other in ("turntable", TURNED))
"""A turntable records and resumes alike with a table and without: `make test` kills the one with a table to
stop, and fills the disk of the other."""
LOST = 2.0
"""s that a kill may cost."""


def drawn(rng, kind, row):
    """A fault of a unit somewhere in a session; garbage is there all the time, at 1 % of bytes."""
    start = 0.0 if kind == "garbled" else float(rng.uniform(0.0, row.lasts))
    lasts = row.lasts if kind == "garbled" else float(rng.uniform(0.3, row.longest))
    unit = str(rng.choice(row.names))
    print(f"{unit} {kind} from {start:.1f} s for {lasts:.1f} s")
    return {unit: [LiveFault(kind, start=start, end=start + lasts)]}


def ended_in_words(done):
    """Returns whether it ended well; asserts that otherwise it ended in one line with the reason."""
    assert "Traceback" not in done.err + done.out, done.err
    assert done.code in (0, 2, 3), done.err
    errors = [line for line in done.err.splitlines() if line.startswith("tumble: error:")]
    assert len(errors) == (done.code == 2), done.err
    return done.code == 0


def judge(row, ended):
    """Looks at how a command ended, at its results, and at all that it recorded."""
    ended_in_words(ended.done)
    row.judge(ended)
    if row.session and (ended.folder / row.session / "session.yaml").exists():
        samples_in(ended.folder / row.session)


@pytest.mark.parametrize("draw", range(DRAWS))
@pytest.mark.parametrize(("name", "kind"), CASES)
def test_a_disturbed_session_ends_in_words_and_finds_nothing_wrong(tmp_path, name, kind, draw):
    row, seed = LIVE[name], 100 * draw + KINDS.index(kind)
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    transport = str(rng.choice(["tcp", "pty", "udp"]))
    judge(row, row.run(tmp_path, seed, faults=drawn(rng, kind, row), kind=kind, transport=transport))


@pytest.mark.parametrize("draw", range(DRAWS))
@pytest.mark.parametrize("name", KILLED)
def test_a_killed_session_leaves_its_recording_and_is_resumed(tmp_path, name, draw):
    row, seed = LIVE[name], 10 * draw + RECORDING.index(name)
    rng = np.random.default_rng(seed)
    with simulated_bench(seed=seed, **row.bench) as bench:
        row.prepare(bench.truth, tmp_path)
    after, operations = rng.uniform(3.0, min(row.lasts, 24.0)), int(rng.integers(0, 30))
    print(f"seed {seed}: killed after {after:.2f} s and {operations} operations")
    killed = killed_on_bench(row.words(tmp_path), after, operations, seed=seed, work=0.1, **row.bench)
    found = samples_in(tmp_path / row.session)
    assert len(found) == len(row.names)
    # Where one unit is recorded, it is by the clock of its sensor.
    latest = LiveScenario().uptime + killed - BEGINS if len(row.names) == 1 else killed
    assert min(rows[-1, 0] for rows in found.values()) > latest - LOST
    if row.resumes:
        judge(row, row.run(tmp_path, seed, "--resume", later=after + 60.0))


@pytest.mark.parametrize("draw", range(DRAWS))
@pytest.mark.parametrize("name", FULL)
def test_full_disk_is_one_line_and_the_recording_goes_on(tmp_path, name, draw, monkeypatch):
    row, seed = LIVE[name], 20 + 10 * draw + RECORDING.index(name)
    room = int(np.random.default_rng(seed).integers(100, 1500))
    print(f"seed {seed}: full after {room} samples")
    original, written = UnitParts.write, []

    def write(self, chunk):
        # However much a busy computer reads at once: there is room for the first of it.
        if written and len(chunk) + sum(samples for _, samples in written) > room:
            raise OutputError("session/a.parts/000002.parquet: cannot be written: No space left on device")
        written.append((self.name, len(chunk)))
        original(self, chunk)

    with monkeypatch.context() as full:
        full.setattr(UnitParts, "write", write)
        ended = row.run(tmp_path, seed, flush=0.1)
    assert ended.done.code == 2
    assert not ended_in_words(ended.done)
    assert "No space left on device; what was recorded is readable" in ended.done.err
    for unit, rows in samples_in(tmp_path / row.session).items():
        assert len(rows) == sum(samples for each, samples in written if each == unit)
    if row.resumes:
        assert "--resume adds to it" in ended.done.err
        judge(row, row.run(tmp_path, seed, "--resume", later=60.0))


@pytest.mark.parametrize("name", LIVE)
def test_two_programs_on_one_port_are_one_line_and_leave_nothing(tmp_path, name):
    row, folder = LIVE[name], tmp_path / "folder"
    folder.mkdir()
    with simulated_bench(**row.bench) as bench:
        row.prepare(bench.truth, folder)
    given = sorted(folder.rglob("*"))
    with socket.socket(type=socket.SOCK_DGRAM) as first:
        first.bind(("127.0.0.1", 0))
        port = first.getsockname()[1]
        taken = {name: f"tcp://127.0.0.{place + 1}:{port}" for place, name in enumerate(row.names)}
        taken[row.names[0]] = f"udp://:{port}"
        done = typed(
            *filled(row.words(folder), SimpleNamespace(addresses=taken, table_address="simulated:two-axis"))
        )
    assert done.code == 2
    assert not ended_in_words(done)
    assert "is another program listening?" in done.err
    assert sorted(folder.rglob("*")) == given

"""Documents of every kind, corrupted: read, or refused in one line with exit code 2."""

from __future__ import annotations

import json
import shutil
import sqlite3
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given

from certified_references import written
from hostile import MOST_BYTES, corrupted, few, for_long, read_or_refuse
from hostile_places import patient
from made_up_calibrations import made_up, save
from made_up_certificates import certificate, project_file
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.tools.simulate import write_turntable
from turntable_sessions import simulate, typed

LOG, TARGET = "session/reference.csv", "session/target_1.csv"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder with a document of each kind."""
    folder = tmp_path_factory.mktemp("whole")
    write_turntable(simulate(3), folder / "session")
    save(folder / "results", made_up(serial="1", log="1"))
    written(folder / "reference.yaml")
    (folder / "reference.xml").write_bytes(dcc_of(certificate(("en",))))
    (folder / "tumble.toml").write_text(project_file())
    (folder / "limits.yaml").write_text("schema: tumble-limits/1\naccelerometer: {bias: 0.5}\n")
    job = "schema: tumble-fleet-job/1\nprocedure: noise\ninputs: 'x/*.csv'\nresults: fleet\n"
    (folder / "job.yaml").write_text(job)
    (folder / "fleet").mkdir()
    (folder / "fleet" / "status.json").write_text(json.dumps({"state": "done", "inputs": 1}))
    stated = "\n".join(f"{name},{10 * number},{10 * number + 9}" for number, name in enumerate("xyz"))
    (folder / "sections.csv").write_text(f"label,start,end\n{stated}\n")
    return folder


CASES = {
    "results/result_0.yaml": ("compare", "results/result_0.yaml", "results/result_0.yaml"),
    "session/poses.yaml": (
        "turntable",
        LOG,
        "session/target_1.csv",
        "--poses",
        "session/poses.yaml",
        "-o",
        "o",
    ),
    "limits.yaml": ("turntable", LOG, TARGET, "--limits", "limits.yaml", "-o", "o"),
    "reference.yaml": ("turntable", LOG, LOG, "--reference-certificate", "reference.yaml", "-o", "o"),
    "reference.xml": ("turntable", LOG, LOG, "--reference-certificate", "reference.xml", "-o", "o"),
    "tumble.toml": ("registry", "list", "--registry", "lab.db"),
    "job.yaml": ("fleet", "status", "job.yaml"),
    "fleet/status.json": ("fleet", "status", "job.yaml"),
    "sections.csv": ("multipose", LOG, "--sections", "sections.csv", "-o", "o"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_corrupted_document_is_read_or_one_line(name, whole, tmp_path, monkeypatch):
    shutil.copytree(whole, tmp_path / "all")
    monkeypatch.chdir(tmp_path / "all")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "nobody"))
    content = (whole / name).read_bytes()

    @few
    @given(corrupted(content))
    def check(changed):
        Path(name).write_bytes(changed)
        with patient():
            done = typed(*CASES[name])
        errors = [line for line in done.err.splitlines() if line.startswith("tumble: error: ")]
        assert done.code in (0, 2, 3), done.err
        assert len(errors) == (done.code == 2), done.err

    for_long(check, 1 / len(CASES))


def bag(path):
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format)")
        database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data BLOB)")
        database.execute("INSERT INTO topics VALUES(1, '/imu', 'sensor_msgs/msg/Imu', 'cdr')")
        rows = [(1, 10_000_000 * n, bytes(4) + bytes(320)) for n in range(200)]
        database.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", rows)
    database.close()


def hdf5(path):
    with h5py.File(path, "w") as file:
        for name in ("time", "ax", "ay", "az", "gx", "gy", "gz"):
            file.create_dataset(name, data=np.arange(400.0), chunks=(100,), compression="gzip")


@pytest.mark.parametrize(("ending", "make"), [("db3", bag), ("h5", hdf5)])
def test_a_corrupted_database_is_read_or_refused_in_bounds(ending, make, tmp_path):
    path = tmp_path / f"log.{ending}"
    make(path)
    content = path.read_bytes()

    @few
    @given(corrupted(content))
    def check(changed):
        path.write_bytes(changed)
        with patient():
            assert read_or_refuse(path) < MOST_BYTES

    for_long(check, 0.5)

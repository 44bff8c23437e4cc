"""Every place that any command takes may be hostile: one line and exit code 2, or a result, never a hang."""

from __future__ import annotations

import glob
import json
import os
import sys
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hostile_places import (
    SERVING,
    commands,
    hostile_files,
    patient,
    places,
    room_for,
    usual,
    without_rights_of_root,
)
from made_up_calibrations import made_up, save
from made_up_certificates import project_file
from repetitions import SOAK, drawn_seed
from tumble.fleet.inputs import inputs_of
from tumble.fleet.job import load_job
from tumble.fleet.ledger import KIND
from tumble.fleet.parts import Outcome, rows, write_parts
from tumble.fleet.places import FileStore
from tumble.foundation import regular_files
from tumble.foundation.errors import OutputError, TumbleError
from tumble.foundation.file_names import file_stem
from tumble.foundation.file_status import paths_like
from tumble.foundation.stores import StoreError
from tumble.laboratory.documents import Documents
from tumble.laboratory.registry import Registry
from tumble.procedures.turntable.batch import LONGEST_LINE, Batch
from tumble.procedures.turntable.record import TargetRecord
from tumble.procedures.turntable.targets import find_targets
from tumble.tools.simulate import write_turntable
from turntable_sessions import simulate, typed
from workplaces import work_in

DRAWN = 120
ENDINGS = (
    *(".csv", ".yaml", ".toml", ".pdf", ".parquet", ".mcap", ".feather"),
    *(".h5", ".npz", ".mat", ".bag", ".db3", ".bin", ".ulg"),
)


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """A folder with a log, a result and a registry, for what a command needs besides the hostile place."""
    work_in(tmp_path, monkeypatch)
    yield hostile_files(tmp_path)
    (tmp_path / "locked").chmod(0o700)


def test_every_command_is_found_by_looking_at_the_command_line():
    found = {words for words, _ in commands()}
    assert {("turntable",), ("registry", "init"), ("certificate", "verify"), ("fleet", "run")} <= found
    assert len(places()) > 150


def test_a_hostile_place_is_one_line_for_every_command(workplace):
    every = [
        (place, what, path)
        for place in places()
        if place.words not in SERVING
        for what, path in workplace.items()
    ]
    bad = []
    for place, what, path in every if SOAK else Random(drawn_seed()).sample(every, DRAWN):
        words = [*place.words, *map(usual, place.needed), *([place.option] if place.option else []), path]
        with without_rights_of_root(), patient():
            done = typed(*words)
        errors = [line for line in done.err.splitlines() if line.startswith("tumble: error: ")]
        if done.code not in (0, 2, 3) or (done.code == 2 and len(errors) != 1) or "Traceback" in done.err:
            bad.append((str(place), what, done.code, done.err))
    assert bad == []


@given(st.text(max_size=600))
def test_a_name_from_any_text_is_one_part_of_a_path(text):
    stem = file_stem(text)
    assert Path(stem).name == stem
    assert stem not in ("", ".", "..")
    assert not stem.startswith(".")
    assert len(stem.encode()) <= 255 - len("-attempt-1000.history.html")
    assert file_stem(stem) == stem


def test_names_that_differ_far_behind_have_different_files():
    assert file_stem("x" * 300 + "1") != file_stem("x" * 300 + "2")


FOR_A_FULL_DISK = (
    ("spin", "session/spin.csv", "-o", "out"),
    ("simulate", "spin", "-o", "out"),
    ("registry", "init", "out.db"),
    ("registry", "add", "results"),
    ("registry", "backup", "out"),
    ("certificate", "key", "out.pem"),
    ("certificate", "issue", "results", "-o", "out"),
    ("convert", "session/spin.csv", "-o", "out.mcap"),
    ("export", "results/result_0.yaml", "--format", "c", "-o", "out.h"),
    ("fleet", "run", "job.yaml", "--workers", "1"),
)
"""Commands that write."""


@pytest.mark.parametrize("words", FOR_A_FULL_DISK, ids=lambda words: " ".join(words[:2]))
def test_a_full_disk_is_one_line_and_leaves_no_half(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "nobody"))
    Registry.create(tmp_path / "lab.db")
    (tmp_path / "tumble.toml").write_text(project_file() + 'registry = "lab.db"\n')
    (tmp_path / "job.yaml").write_text("procedure: spin\ninputs: session/spin.csv\nresults: out\n")
    save(tmp_path / "results", made_up(serial="1", log="1"))
    assert typed("simulate", "spin", "--turns", "2", "-o", "session").code == 0
    before = {path.name: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    for size in (0, 100):
        with patient(), room_for(size):
            done = typed(*words)
        assert (done.code, done.out) == (2, ""), done
        assert len([line for line in done.err.splitlines() if line.startswith("tumble: error: ")]) == 1
        left = {path.name: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        made = {name for name in left.keys() - before if "-wal" not in name and "-shm" not in name}
        assert all(left.get(name) == content for name, content in before.items() if name != "lab.db")
        assert made <= {"out.db"}  # empty, so that init goes on with it
    assert typed("registry", "verify").code == 0
    assert typed(*words).code in (0, 3)


@pytest.fixture
def around(tmp_path, monkeypatch):
    """A folder, of a name that is a pattern, with links that lead around in more ways than can be counted."""
    folder = tmp_path / "lot[1]"
    (folder / "a" / "b").mkdir(parents=True)
    for name in ("first", "second"):
        (folder / name).symlink_to(".")
    (folder / "itself").symlink_to("itself")
    for name in ("x.csv", "a/x.csv", "a/b/x.csv", "a/.hidden.csv", ".hidden.csv"):
        (folder / name).write_text("time,ax,ay,az,gx,gy,gz\n")
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.parametrize(
    ("pattern", "found"),
    [
        ("*.csv", ["x.csv"]),
        ("**/*.csv", ["a/b/x.csv", "a/x.csv", "x.csv"]),
        ("**.csv", ["x.csv"]),
        ("a/**", ["a/b", "a/b/x.csv", "a/x.csv"]),
        ("a/.*.csv", ["a/.hidden.csv"]),
        ("[ax]*/*.csv", ["a/x.csv"]),
        ("a/x.csv", ["a/x.csv"]),
        ("a/y.csv", []),
        ("*/nothing", []),
    ],
)
def test_a_pattern_fits_what_a_shell_finds_and_never_hangs(around, pattern, found):
    with patient():
        assert paths_like(pattern) == found
    if "**/" not in pattern and "/**" not in pattern:
        assert sorted(glob.glob(pattern)) == found  # noqa: PTH207 - what it is held against


def test_links_that_lead_around_end_no_search_for_logs(around):
    (around / "itself").unlink()
    job = around / "job.yaml"
    job.write_text('procedure: spin\ninputs: "**/*.csv"\nresults: results\n')
    with patient():
        assert len(list(inputs_of(load_job(job)))) == 3
        found = find_targets([str(around)], "x.csv").targets
    assert {Path(each.source).name for each in found} == {"x.csv"}
    assert len({Path(each.source).resolve() for each in found}) == len(found) == 2


@pytest.mark.parametrize("name", ["../x", "parts/../../x", "/x", "parts//x", "."])
def test_a_store_has_nothing_outside_itself(tmp_path, name):
    with pytest.raises(StoreError, match="does not lie within"):
        FileStore(str(tmp_path / "store")).write(name, b"x", KIND)
    assert list(tmp_path.iterdir()) == []


@given(st.text(max_size=40))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_day_of_a_manifest_leads_out_of_the_results(tmp_path, text):
    for day in (text, f"x/../../../../{text}", f"/{text}", f"..{text}"):
        store = FileStore(str(tmp_path / "results"))
        (written,) = write_parts(store, [Outcome(bytes(16), "log.csv", day=day)])
        assert store.read(written) is not None
        assert [path.name for path in tmp_path.iterdir()] == ["results"]
        assert [row["day"] for row in rows(store, ["day"])] == [day]
        (tmp_path / "results" / written).unlink()


def test_a_batch_with_a_name_that_is_no_utf_8_is_read_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_turntable(simulate(3), tmp_path / "session")
    name = os.fsdecode(b"rob\xe9t.csv")
    (tmp_path / "session" / "target_1.csv").rename(tmp_path / "session" / name)
    for attempt in (1, 2):
        done = typed(
            "turntable", "session/reference.csv", f"session/{name}", "-o", "results", "--gravity", "9.8"
        )
        assert done.code == 0, done.err
        (last,) = Batch(tmp_path / "results").latest()
        assert (last.target, last.attempt) == (r"rob\xe9t", attempt)


def test_a_line_of_a_batch_names_no_file_elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_turntable(simulate(3), tmp_path / "session")
    words = ("session/reference.csv", "session/target_1.csv", "-o", "results", "--gravity", "9.8")
    assert typed("turntable", *words).code == 0
    path = tmp_path / "results" / "batch.jsonl"
    line = path.read_text()
    assert TargetRecord.from_line(line).stem == "target_1"
    path.write_text(line.replace('"stem":"target_1"', '"stem":"../target_1"'))
    with pytest.raises(OutputError, match="is no batch of tumble turntable, and is kept"):
        Batch(tmp_path / "results")
    for key, value in json.loads(line).items():
        for other in ({"a": 1}, [[1]], {"a": 1} if isinstance(value, str) else "x"):
            changed = json.dumps(json.loads(line) | {key: other})
            if key in ("columns", "warnings") and isinstance(other, type(value)):
                continue
            with pytest.raises(ValueError, match=r"validation error|no record"):
                TargetRecord.from_line(changed)
    path.write_bytes(b"x" * (3 * LONGEST_LINE) + b"\n" + line.encode() + b"y" * LONGEST_LINE)
    kept = Batch(tmp_path / "results")
    assert kept.lost_lines == [1, 3]
    kept.drop_lost_lines()
    assert path.read_text() == line
    assert [each.stem for each in kept.latest()] == ["target_1"]
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(OutputError, match="is a device or a pipe"):
        Batch(tmp_path / "results")


def test_a_pipe_among_files_of_a_job_or_a_registry_is_never_read(tmp_path):
    store, documents = tmp_path / "results", tmp_path / "documents"
    store.mkdir()
    os.mkfifo(store / "status.json")
    with patient(), pytest.raises(StoreError, match=r"status\.json: is a device or a pipe"):
        FileStore(str(store)).read("status.json")
    digest = "ab" * 32
    (documents / "ab").mkdir(parents=True)
    os.mkfifo(documents / "ab" / digest)
    with patient(), pytest.raises(TumbleError, match="is a device or a pipe"):
        Documents(str(documents)).read(digest)


@pytest.mark.skipif(sys.platform != "linux", reason="files without an answer are those of Linux")
def test_a_file_that_gives_no_bytes_is_one_line_for_every_command(workplace, monkeypatch):
    begun = regular_files._opened

    def opened(path, flags):
        descriptor = begun(path, flags)
        # In place of a file of FUSE: one that has nothing to read yet, and one whose disk fails.
        given = {"waiting": lambda: os.eventfd(0, os.EFD_NONBLOCK), "failing": _failing}
        if other := given.get(Path(path).stem):
            os.close(descriptor)
            return other()
        return descriptor

    monkeypatch.setattr(regular_files, "_opened", opened)
    every = [
        (place, f"{name}{ending}")
        for place in places()
        if place.words not in SERVING
        for name in ("waiting", "failing")
        for ending in ENDINGS
    ]
    bad = []
    for place, name in every if SOAK else Random(drawn_seed()).sample(every, DRAWN // 3):
        Path(name).write_bytes(b"x" * 100)
        words = [*place.words, *map(usual, place.needed), *([place.option] if place.option else []), name]
        with patient():
            done = typed(*words)
        errors = [line for line in done.err.splitlines() if line.startswith("tumble: error: ")]
        if done.code not in (0, 2, 3) or (done.code == 2 and len(errors) != 1):
            bad.append((str(place), name, done))
    assert bad == []


def _failing():
    return os.open("/proc/self/mem", os.O_RDONLY)

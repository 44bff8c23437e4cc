"""Files that any command writes or removes are its own or new: all else of that name stays, in one line."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from log_fixtures import made_up as made_up_log
from log_fixtures import write
from made_up_calibrations import made_up, save
from made_up_certificates import project_file
from repetitions import by_turns
from tumble.bench.run_folder import KIND, RunFolder
from tumble.fleet.places import FileStore
from tumble.foundation.errors import OutputError
from tumble.foundation.files import link, move_into, move_to, remove_folder, remove_made
from tumble.foundation.folder_lock import LOCK_FILE, FolderLock
from tumble.laboratory.registry import Registry
from tumble.logs.writers import FORMATS
from tumble.tools.demo.scene import simulating
from tumble.tools.record.session_folders import next_session_folder
from turntable_sessions import one_line, typed

FOREIGN = {
    ".html": b"<!DOCTYPE html><h1>mine</h1>",
    ".pdf": b"%PDF-1.7\n% mine\n",
    ".xml": b'<dcc:digitalCalibrationCertificate xmlns:dcc="https://ptb.de/dcc"/>',
    ".parquet": b"PAR1 mine PAR1",
    ".mcap": b"\x89MCAP0\r\n\x01\x0d\0\0\0\0\0\0\0\0\0\0\0\x05\0\0\0other",
    ".rrd": b"RRF2 mine",
    ".csv": b"time,ax,ay,az,gx,gy,gz\n0,0,0,9.8,0,0,0\n",
    ".json": b'{"name": "my project"}',
    ".jsonl": b'{"time": 0, "mine": 1}\n',
    ".yaml": b"name: mine\n",
    ".params": b"1\t1\tCAL_ACC0_XOFF\t0\t9\n",
    ".param": b"INS_ACCOFFS_X,0\n",
    ".calib": b"1 0 0\n0 1 0\n0 0 1\n",
}
"""Content of others in the format of each ending, whose first bytes are those of ours."""
COMMANDS = (
    ("simulate", "spin", "--turns", "1", "--still", "3"),
    ("simulate", "multipose"),
    ("simulate", "multipose", "--faces"),
    ("simulate", "magnetometer"),
    ("spin", "spin.csv", "--still", "2s"),
    ("multipose", "session/multipose.csv"),
    ("noise", "still.csv"),
    ("compare", "results0/result_0.yaml", "results1/result_0.yaml"),
    ("certificate", "results0/result_0.yaml", "--number", "X1", "--registry", ""),
    ("registry", "export", "{}/units.csv"),
    ("registry", "export", "{}/units.json"),
    ("convert", "spin.csv", "-o", "{}/log.csv"),
    ("convert", "spin.csv", "-o", "{}/log.parquet"),
    ("convert", "spin.csv", "-o", "{}/log.mcap"),
    ("apply", "--force", "results0/result_0.yaml", "spin.csv", "-o", "{}/corrected.csv"),
    ("view", "spin.csv", "--rerun", "{}/log.rrd"),
    ("view", "spin.csv", "--mcap", "{}/view.mcap"),
    (
        "export",
        "results0/result_0.yaml",
        "--format",
        "px4",
        "--set",
        "accelerometer-id=1",
        "--set",
        "gyroscope-id=2",
        "-o",
        "{}/a.params",
    ),
    ("export", "results0/result_0.yaml", "--format", "ardupilot", "-o", "{}/a.param"),
    ("export", "results0/result_0.yaml", "--format", "imucal", "-o", "{}/a.json"),
    ("export", "results0/result_0.yaml", "--format", "imu-tk-accelerometer", "-o", "{}/a.calib"),
    ("export", "results0/result_0.yaml", "--format", "ros2", "-o", "{}/a.yaml"),
)
"""Commands that write into a folder, `-o` of which is the folder where no place of it is given."""


def words(command, folder):
    if any("{}" in each for each in command):
        return [each.replace("{}", str(folder)) for each in command]
    return [*command, "-o", str(folder)]


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A folder with logs, results and a registry."""
    folder = tmp_path_factory.mktemp("work")
    before = Path.cwd()
    os.chdir(folder)
    Registry.create(folder / "lab.db")
    (folder / "tumble.toml").write_text(project_file() + 'registry = "lab.db"\n')
    for number in "01":
        save(folder / f"results{number}", made_up(serial=number, log=number))
    assert typed("registry", "add", "results0/result_0.yaml").code == 0
    assert typed("simulate", "spin", "--turns", "1", "--still", "3", "-o", ".", "--seed", "1").code == 0
    assert typed("simulate", "multipose", "-o", "session", "--seed", "1").code == 0
    write(folder / "still.csv", made_up_log(3000))
    yield folder
    os.chdir(before)


LINKS = ("link", "hard link", "dangling link")


def placed(what, path, victim):
    """Puts at a path something that is not ours; returns whether it leads to the victim."""
    if what == "foreign":
        path.write_bytes(FOREIGN.get(path.suffix, b"mine\n"))
    elif what == "link":
        path.symlink_to(victim)
    elif what == "hard link":
        path.hardlink_to(victim)
    else:
        path.symlink_to(victim.with_name("nobody"))


def state(path):
    return (path.is_symlink(), path.read_bytes() if path.exists() else None, path.lstat().st_ino)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda each: " ".join(each[:4]))
def test_what_is_not_ours_stays_whatever_a_command_writes(workplace, tmp_path, command):
    first = tmp_path / "first"
    first.mkdir()
    done = typed(*words(command, first))
    assert done.code in (0, 3), done.err
    names = [path.relative_to(first) for path in first.rglob("*") if path.is_file()]
    assert names
    names += [] if any("{}" in each for each in command) else [Path(LOCK_FILE)]
    for number, name in enumerate(names, start=COMMANDS.index(command)):
        # Foreign contents differ by the kind of a file; links are all refused alike, and take turns.
        for what in ("foreign", *by_turns(LINKS, number, len(LINKS))):
            folder = tmp_path / f"{what} {name}".replace("/", " ")
            (folder / name).parent.mkdir(parents=True)
            victim = tmp_path / "victim"
            if name == Path(LOCK_FILE):
                victim.write_bytes(b"thesis")
            else:
                shutil.copyfile(first / name, victim)  # of our own kind: only the link is wrong
            placed(what, folder / name, victim)
            before, of_victim = state(folder / name), state(victim)
            done = typed(*words(command, folder))
            assert done.code == 2, (what, name, done.out, done.err)
            errors = [line for line in done.err.splitlines() if line.startswith("tumble: error: ")]
            assert len(errors) == 1, done.err
            assert "is kept" in errors[0], errors
            assert (state(folder / name), state(victim)) == (before, of_victim), (what, name)
            assert not (tmp_path / "nobody").exists()
            victim.unlink()
            shutil.rmtree(folder)


@pytest.mark.parametrize(
    "command", [each for each in COMMANDS if each[-1] != "{}/a.calib"], ids=lambda each: " ".join(each[:4])
)
def test_a_command_replaces_what_it_wrote_before(workplace, tmp_path, command):
    first, second = typed(*words(command, tmp_path)), typed(*words(command, tmp_path))
    assert (first.code, second.code) in ((0, 0), (3, 3)), second.err
    assert "replaced in" in second.err


def test_a_bench_keeps_json_of_others(tmp_path):
    state = tmp_path / "bench.json"
    state.write_bytes(FOREIGN[".json"])
    assert "is kept" in one_line(typed("bench", "--folder", tmp_path, "--port", "0").err)
    assert state.read_bytes() == FOREIGN[".json"]


def test_a_fleet_keeps_status_and_cancel_of_others(tmp_path):
    store = FileStore(str(tmp_path / "results"))
    from tumble.fleet import ledger

    for name in (ledger.STATUS_FILE, ledger.CANCEL_FILE):
        path = tmp_path / "results" / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(FOREIGN[".json"])
        with pytest.raises(OutputError, match="is kept"):
            store.write(name, b"{}", ledger.KIND)
        with pytest.raises(OutputError, match="is kept"):
            store.remove(name, ledger.KIND)
        assert path.read_bytes() == FOREIGN[".json"]


def test_a_linked_folder_of_parts_is_not_written_into(tmp_path):
    (tmp_path / "outside").mkdir()
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "parts").symlink_to(tmp_path / "outside")
    store = FileStore(str(tmp_path / "results"))
    with pytest.raises(OutputError, match="is a link, and is kept"):
        store.write("parts/day=1/a.parquet", b"PAR1", FORMATS["parquet"])
    with pytest.raises(OutputError, match="is a link, and is kept"):
        remove_folder(tmp_path / "results" / "parts", FORMATS["parquet"])
    assert list((tmp_path / "outside").iterdir()) == []
    (tmp_path / "outside" / "a.parquet").write_bytes(b"")
    with pytest.raises(OutputError, match="is a link, and is kept"):
        store.remove("parts/a.parquet", FORMATS["parquet"])
    assert (tmp_path / "outside" / "a.parquet").exists()


def test_a_session_beside_results_is_never_behind_a_link(tmp_path):
    (tmp_path / "session").symlink_to(tmp_path / "nobody")
    assert next_session_folder(tmp_path) == tmp_path / "session-2"
    with pytest.raises(OutputError, match="is a link, and is kept"):
        simulating(tmp_path)


def test_a_folder_of_parts_keeps_files_of_others(tmp_path):
    parts = tmp_path / "a.parts"
    parts.mkdir()
    (parts / "notes.txt").write_text("mine")
    (parts / "mine.parquet").write_bytes(FOREIGN[".parquet"])
    (parts / f".{'0' * 16}.tmp").write_bytes(b"of a killed run")
    remove_folder(parts, FORMATS["parquet"])
    assert sorted(path.name for path in parts.iterdir()) == ["mine.parquet", "notes.txt"]


def test_renaming_and_removing_touch_no_link(tmp_path):
    victim = tmp_path / "victim"
    victim.write_bytes(b"{}")
    for number, make in enumerate((Path.symlink_to, Path.hardlink_to)):
        name = tmp_path / f"name-{number}"
        make(name, victim)
        for change in (
            lambda: remove_made(name, kind=KIND),  # noqa: B023 - called at once
            lambda: move_into(name, tmp_path / "earlier", "name"),  # noqa: B023
            lambda: move_to(victim, name),  # noqa: B023
            lambda: link(name, "/dev/null"),  # noqa: B023
        ):
            with pytest.raises(OutputError):
                change()
        assert name.exists()
    assert victim.read_bytes() == b"{}"


def test_a_lock_in_a_folder_that_is_none_any_more_is_one_line(tmp_path):
    folder = tmp_path / "reference.parts"
    folder.mkdir()
    lock = FolderLock(folder)
    shutil.rmtree(folder)
    folder.write_text("a file")
    with pytest.raises(OutputError, match="is none any more"):
        lock.release()
    assert folder.read_text() == "a file"


def test_an_order_of_another_is_not_removed(tmp_path):
    order = tmp_path / "order.json"
    order.write_text(json.dumps({"mine": 1}))
    with pytest.raises(OutputError, match="is kept"):
        RunFolder(tmp_path, "spin", None).remove_if_empty()
    assert order.exists()

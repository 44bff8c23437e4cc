"""Files that commands write: whole, under names that do not collide, and never over something else."""

from __future__ import annotations

import ast
import os
import stat
from pathlib import Path

import pytest

import tumble
from log_fixtures import made_up, write
from tumble.foundation.file_names import TAKEN, file_stem, unit_stem
from tumble.foundation.files import PAGE, check_output, refuse_others_name, write_text
from turntable_sessions import contents, one_line, typed

PACKAGE = Path(tumble.__file__).parent
WRITES = {"write_text", "write_bytes", "touch", "mkdir", "rename", "unlink", "symlink_to", "rmdir", "savefig"}
WRITING_MODES = set("wax+")


def writes_of(source):
    """Calls that change something on disk: line and name.

    `path.replace(target)` has one argument, `text.replace(a, b)` two, `dataclasses.replace` keywords.
    """
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        function = node.func
        name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
        texts = {each.value for each in ast.walk(node) if isinstance(each, ast.Constant)}
        modes = {text for text in texts if isinstance(text, str) and len(text) <= 3}
        method = isinstance(function, ast.Attribute)
        to_path = name == "replace" and len(node.args) == 1 and not node.keywords
        for_writing = name == "open" and any(WRITING_MODES & set(mode) for mode in modes)
        if for_writing or (method and (name in WRITES or to_path)):
            yield node.lineno, name


def test_no_module_but_one_changes_anything_on_disk():
    found = {
        str(path.relative_to(PACKAGE)): list(writes_of(path.read_text(encoding="utf-8")))
        for path in PACKAGE.rglob("*.py")
    }
    assert {name for name, writes in found.items() if writes} == {
        "foundation/files.py",
        "foundation/folder_lock.py",
        "foundation/temporary_folders.py",
    }
    assert {name for _, name in found["foundation/files.py"]} == {
        "mkdir",
        "open",
        "rename",
        "replace",
        "symlink_to",
        "touch",
        "unlink",
        "write_text",
        "rmdir",
    }


@pytest.fixture
def log(tmp_path):
    return write(tmp_path / "log.csv", made_up(500))


@pytest.fixture
def unit(tmp_path):
    """A calibration file that changes nothing."""
    path = tmp_path / "unit.yaml"
    path.write_text(
        "schema: tumble-calibration/1\nname: unit\n"
        "gyroscope: {unit: rad/s, M: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], b: [0, 0, 0]}\n"
    )
    return path


def refused(*words):
    done = typed(*words)
    assert done.code == 2, done.out
    return one_line(done.err)


@pytest.mark.parametrize("name", ["log.csv", "unit.yaml", "hard.csv", "link.csv", "sub/../log.csv"])
def test_apply_overwrites_neither_log_nor_calibration(tmp_path, log, unit, name):
    (tmp_path / "sub").mkdir()
    (tmp_path / "hard.csv").hardlink_to(log)
    (tmp_path / "link.csv").symlink_to(unit)
    before = contents(tmp_path)
    assert "is what is read" in refused("apply", unit, log, "-o", tmp_path / name, "--format", "csv")
    assert contents(tmp_path) == before


def test_a_log_is_not_written_over_a_file_of_another_kind(tmp_path, log, unit):
    for name, text in (("notes.csv", "my notes\n"), ("page.csv", "<!doctype html>"), ("raw.csv", "t;x;y\n")):
        (tmp_path / name).write_text(text)
        assert "is not a CSV log" in refused("apply", unit, log, "-o", tmp_path / name)
        assert (tmp_path / name).read_text() == text


def test_results_never_replace_a_file_of_another_kind(tmp_path, unit):
    limits = tmp_path / "limits.yaml"
    limits.write_text("schema: tumble-limits/1\naccelerometer: {bias: 1.0}\n")
    with pytest.raises(tumble.OutputError, match="is not a document of schema tumble-calibration"):
        tumble.Calibration.load(unit).save(limits)
    with pytest.raises(tumble.OutputError, match="is not an HTML page"):
        write_text(limits, "<!doctype html>", PAGE)
    assert limits.read_text().startswith("schema: tumble-limits")
    tumble.Calibration.load(unit).save(unit)
    assert tumble.Calibration.load(unit).name == "unit"


def test_devices_and_pipes_are_refused_and_stay_what_they_are(tmp_path, log, unit):
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    link = tmp_path / "null.csv"
    link.symlink_to("/dev/null")
    assert "is a link" in refused("apply", unit, log, "-o", link, "--format", "csv")
    for path in (pipe, "/dev/null", "/dev/full"):
        assert "is a device or a pipe" in refused("apply", unit, log, "-o", path, "--format", "csv")
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert link.is_symlink()
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


@pytest.mark.parametrize(("path", "part"), [("-", "not to standard output"), ("", "--output is empty")])
def test_standard_output_and_an_empty_name_are_no_places_for_a_log(log, unit, path, part):
    assert part in refused("apply", unit, log, "-o", path, "--format", "csv")


@pytest.mark.parametrize("command", [("spin",), ("turntable",), ("align", "--primary", "a", "--secondary")])
def test_an_empty_name_is_no_folder_for_results(log, command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "--output is empty" in refused(*command, log, log, "-o", "")


def test_a_folder_that_is_named_by_a_link_is_written_into(tmp_path, log, unit):
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there")
    assert typed("apply", unit, log, "-o", tmp_path / "link" / "out.csv").code == 0
    assert (tmp_path / "there" / "out.csv").is_file()


def test_links_that_lead_around_are_refused(tmp_path):
    (tmp_path / "a.html").symlink_to(tmp_path / "b.html")
    (tmp_path / "b.html").symlink_to(tmp_path / "a.html")
    with pytest.raises(tumble.OutputError, match="is a link, and is kept"):
        write_text(tmp_path / "a.html", "<!doctype html>", PAGE)


def test_a_name_as_long_as_files_may_have_is_written(tmp_path):
    path = tmp_path / f"{'n' * 250}.html"
    write_text(path, '<!doctype html><meta name="generator" content="Tumble">', PAGE)
    assert check_output(path, PAGE) == path


def test_every_replaced_file_is_named_and_only_those(tmp_path):
    words = ("simulate", "spin", "--turns", "1", "--still", "3", "-o", tmp_path)
    assert typed(*words).err == ""
    assert typed(*words).err == f"tumble: replaced in {tmp_path}: spin.csv, truth.yaml\n"


@pytest.mark.parametrize(
    "name", [*sorted(TAKEN), "drive.spin", "drive.live", "drive.redundancy", "board-1.2"]
)
def test_no_procedure_names_a_file_as_another_one_does(name):
    from tumble.procedures.turntable.report.pages import page_names

    target = type("Target", (), {"name": name})
    turntable = Path(page_names([target])[0]).stem
    others = [unit_stem(name, procedure) for procedure in ("spin", "live", "redundancy")]
    assert len({turntable, *others}) == 4
    for other in ("drive", "spin", "live", "redundancy", "drive_spin"):
        assert turntable not in {unit_stem(other, procedure) for procedure in ("spin", "live", "redundancy")}


def test_a_name_keeps_what_a_file_can_bear():
    assert file_stem("board-1.2+x") == "board-1.2+x"
    assert file_stem("/imu/data raw") == "imu_data_raw"
    assert file_stem("...") == "unit"


def test_results_go_to_a_folder_named_after_the_log_by_default(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert typed("simulate", "spin", "--turns", "2", "--seed", "7").code == 0
    assert typed("spin", "spin-tumble/spin.csv").code == 0
    names = {"spin-tumble/" + name for name in ("spin.csv", "truth.yaml", "spin.html", "spin.yaml")}
    assert set(contents(tmp_path)) == names
    assert typed("apply", "spin-tumble/spin.yaml", "spin-tumble/spin.csv").code == 0
    assert set(contents(tmp_path)) == {*names, "spin-tumble.csv"}


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("turntable",), "REFERENCE"),
        (("apply",), "CALIBRATION"),
        (("spin",), "log"),
        (("redundancy",), "--primary"),
        (("align",), "--primary"),
        (("inspect",), "LOG"),
    ],
)
def test_first_reported_condition_is_the_most_important_one(words, part):
    done = typed(*words)
    assert done.code == 2
    assert part in done.err
    assert "--output" not in done.err


@pytest.mark.parametrize("looks", range(1, 6))
def test_a_file_that_is_removed_meanwhile_is_no_other_file(tmp_path, monkeypatch, looks):
    """SQLite removes its journals whenever the last program leaves a registry."""
    path, look, count = tmp_path / "lab.db-wal", Path.stat, iter(range(1, 100))
    path.write_text("journal")

    def look_and_remove(self, **options):
        try:
            return look(self, **options)
        finally:
            if next(count) == looks:
                path.unlink()

    monkeypatch.setattr(Path, "stat", look_and_remove)
    refuse_others_name(path)

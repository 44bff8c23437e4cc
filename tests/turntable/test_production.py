"""A batch on a production line: what a folder keeps, what is repeated, who did what and when."""

from __future__ import annotations

import csv
import hashlib
import json
import re
import shutil

import pytest

import tumble
from simulated_clock import DATE
from tumble.foundation.errors import OutputError
from tumble.poses.pose_list import SIX_FACES
from tumble.procedures.turntable import production
from tumble.procedures.turntable.record import TargetRecord
from turntable_sessions import calibrated, contents, refusal, rows, simulate, typed, write

ENDINGS = (".yaml", ".html")


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    """A folder of twelve units, each with its serial, and the log of the reference beside it."""
    folder = tmp_path_factory.mktemp("line")
    session = simulate(91, grades=("industrial", "tactical"))
    reference, *logs = write(session, folder / "simulated")
    reference.rename(folder / "reference.csv")
    (folder / "units").mkdir()
    for number in range(1, 13):
        give_serial(logs[number % 2], folder / f"units/unit_{number}.csv", f"SN-{number}")
    return folder


def give_serial(log, path, serial):
    lines = log.read_text().splitlines(keepends=True)
    kept = [each for each in lines if not each.startswith("# serial:")]
    path.write_text("".join([f"# serial: {serial}\n" if serial else "", *kept]))


@pytest.fixture
def units(line, tmp_path):
    """A few units of the line that a test may change, and its reference."""
    (tmp_path / "units").mkdir()
    for number in (1, 2, 3):
        shutil.copy(line / f"units/unit_{number}.csv", tmp_path / "units")
    shutil.copy(line / "reference.csv", tmp_path)
    return tmp_path


def run(units, *arguments, targets="units", code=0):
    return calibrated(units / "reference.csv", units / targets, "-o", units / "out", *arguments, code=code)


def attempts(folder):
    return [json.loads(line) for line in (folder / "batch.jsonl").read_text().splitlines()]


# The folder is the batch.


def test_a_run_of_one_unit_keeps_the_others_in_summary_and_report(units):
    run(units)
    before = contents(units / "out")
    run(units, "--g-sensitivity", targets="units/unit_2.csv")
    after = rows(units / "out")
    assert list(after) == ["unit_1", "unit_2", "unit_3"]
    assert [row["attempt"] for row in after.values()] == ["1", "2", "1"]
    page = (units / "out/turntable.html").read_text()
    assert all(f'href="unit_{number}.html"' in page for number in (1, 2, 3))
    for name in ("unit_1", "unit_3"):
        for ending in ENDINGS:
            assert contents(units / "out")[name + ending] == before[name + ending]
    assert contents(units / "out")["unit_2.yaml"] != before["unit_2.yaml"]


def test_each_attempt_keeps_its_date(units, monkeypatch):
    run(units)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", str(DATE + 86_400))
    run(units, targets="units/unit_2.csv")
    found = rows(units / "out")
    assert found["unit_1"]["date"] == "2026-11-26T00:00:00Z"
    assert found["unit_2"]["date"] == "2026-11-27T00:00:00Z"
    assert [each["date"][8:10] for each in attempts(units / "out") if each["target"] == "unit_2"] == [
        "26",
        "27",
    ]


def test_json_tells_of_all_targets_of_the_folder(units):
    run(units)
    done = run(units, "--json", targets="units/unit_2.csv")
    found = json.loads(done.out)["targets"]
    assert [(each["name"], each["attempt"]) for each in found] == [
        ("unit_1", 1),
        ("unit_2", 2),
        ("unit_3", 1),
    ]
    assert [each["calibration"] is not None for each in found] == [False, True, False]


def test_calibration_of_a_unit_that_fails_later_is_kept_aside(units):
    run(units)
    before = contents(units / "out")
    (units / "units/unit_2.csv").write_text("time,ax,ay,az,gx,gy,gz\n")
    done = run(units, targets="units/unit_2.csv", code=3)
    after = contents(units / "out")
    assert after["earlier/unit_2-attempt-1.yaml"] == before["unit_2.yaml"]
    assert after["unit_2.html"] != before["unit_2.html"]
    assert "unit_2.yaml" not in after
    assert "unit_2-attempt-1.yaml is of an earlier attempt" in done.err
    found = rows(units / "out")
    assert [row["verdict"] for row in found.values()] == ["calibrated", "not calibrated", "calibrated"]
    assert found["unit_2"]["attempt"] == "2"
    assert not (units / "out/earlier/unit_2-attempt-2.yaml").exists()


def test_page_of_an_earlier_attempt_goes_where_the_last_has_none(units):
    run(units)
    before = contents(units / "out")
    run(units, "--pages", "none", targets="units/unit_2.csv")
    after = contents(units / "out")
    assert "unit_2.html" not in after
    assert after["earlier/unit_2-attempt-1.html"] == before["unit_2.html"]
    assert 'href="unit_2.html"' not in after["turntable.html"].decode()


def test_run_without_a_new_calibration_changes_nothing(units):
    run(units)
    before = contents(units / "out")
    (units / "empty.csv").write_text("")
    assert "is empty" in refusal(units / "reference.csv", units / "empty.csv", "-o", units / "out")
    assert contents(units / "out") == before


def test_another_unit_under_a_name_of_the_folder_is_refused(units):
    run(units)
    before = contents(units / "out")
    give_serial(units / "units/unit_2.csv", units / "units/unit_2.csv", "SN-99")
    said = refusal(units / "reference.csv", units / "units/unit_2.csv", "-o", units / "out")
    assert "holds results of serial SN-2 under the name unit_2" in said
    assert contents(units / "out") == before


def test_a_stop_half_way_keeps_what_is_done_in_summary_and_report(units, monkeypatch):
    add = production.Batch.add
    done = []

    def stopping(batch, record):
        if done:
            raise KeyboardInterrupt
        done.append(record)
        add(batch, record)

    monkeypatch.setattr(production.Batch, "add", stopping)
    assert typed("turntable", units / "reference.csv", units / "units", "-o", units / "out").code == 130
    monkeypatch.undo()
    assert list(rows(units / "out")) == ["unit_1"]
    assert "1 target" in (units / "out/turntable.html").read_text()
    finished = run(units, "--resume")
    assert "1 were done and unchanged" in finished.text
    assert list(rows(units / "out")) == ["unit_1", "unit_2", "unit_3"]


@pytest.mark.parametrize("cut", [1, 30, 2000])
def test_a_line_that_was_cut_short_costs_its_own_attempt_only(units, cut):
    run(units)
    path = units / "out/batch.jsonl"
    path.write_bytes(path.read_bytes()[:-cut])
    done = run(units, "--resume")
    lost = cut > 1
    assert ("line 3 was cut short" in done.err) == lost
    assert f"{2 if lost else 3} were done and unchanged" in done.text
    assert {name: row["attempt"] for name, row in rows(units / "out").items()} == {
        f"unit_{number}": "1" for number in (1, 2, 3)
    }


def test_a_file_of_that_name_that_is_no_batch_is_refused_and_kept(units):
    (units / "out").mkdir()
    (units / "out/batch.jsonl").write_text('{"mine": 1}\n')
    assert "is no batch of tumble turntable" in refusal(
        units / "reference.csv", units / "units", "-o", units / "out"
    )
    assert (units / "out/batch.jsonl").read_text() == '{"mine": 1}\n'
    with pytest.raises(OutputError):
        production.Batch(units / "out")


def test_a_record_reads_back_as_it_was_written(units):
    run(units)
    for line in (units / "out/batch.jsonl").read_text().splitlines():
        assert TargetRecord.from_line(line).line() == line


# Repeated runs.


def test_finished_and_unchanged_target_is_left_alone(units):
    run(units)
    before = contents(units / "out")
    done = run(units, "--resume")
    assert "3 were done and unchanged" in done.text
    assert contents(units / "out") == before


@pytest.mark.parametrize("change", ["log", "option", "reference", "limits", "calibration file", "page"])
def test_changed_target_is_calibrated_again(units, change):
    run(units)
    limits = units / "limits.yaml"
    limits.write_text("accelerometer: {bias: 5.0}\n")
    more = {"option": ["--g-sensitivity"], "limits": ["--limits", limits]}.get(change, [])
    changed = {"log": units / "units/unit_2.csv", "reference": units / "reference.csv"}.get(change)
    if changed:
        changed.write_text(changed.read_text().rsplit("\n", 2)[0] + "\n")
    if change == "calibration file":
        (units / "out/unit_2.yaml").unlink()
    if change == "page":
        (units / "out/unit_2.html").unlink()
    run(units, "--resume", *more)
    again = {name for name, row in rows(units / "out").items() if row["attempt"] == "2"}
    alone = change in ("log", "calibration file", "page")
    assert again == ({"unit_2"} if alone else {"unit_1", "unit_2", "unit_3"})


# Which recordings are meant, and what they are named.


def test_folder_pattern_and_shell_list_are_sorted_in_natural_order(line, tmp_path):
    listed = sorted(map(str, (line / "units").iterdir()))
    assert listed[1].endswith("unit_10.csv"), "the shell sorts by letters"
    for number, targets in enumerate(([line / "units"], [line / "units/*.csv"], listed)):
        out = tmp_path / f"out_{number}"
        calibrated(line / "reference.csv", *targets, "--pages", "none", "-o", out)
        assert list(rows(out)) == [f"unit_{number}" for number in range(1, 13)]


def test_pattern_without_match_and_empty_folder_are_refused(units):
    assert "no file matches" in refusal(units / "reference.csv", units / "units/*.bag", "-o", units / "out")
    (units / "empty").mkdir()
    assert "a folder without logs" in refusal(units / "reference.csv", units / "empty", "-o", units / "out")


def test_reference_in_the_folder_of_targets_is_left_out_with_remark(units):
    shutil.move(units / "reference.csv", units / "units/a_reference.csv")
    done = calibrated(units / "units/a_reference.csv", units / "units/*.csv", "-o", units / "out")
    assert "a_reference.csv is the reference, and left out of the targets" in done.err
    assert list(rows(units / "out")) == ["unit_1", "unit_2", "unit_3"]
    line = refusal(units / "units/a_reference.csv", units / "units/a_reference.csv", "-o", units / "out")
    assert "there is no target besides the reference" in line


def test_results_in_the_folder_of_the_logs_are_not_taken_for_logs(units):
    for _ in range(2):
        calibrated(units / "reference.csv", units / "units", "-o", units / "units/out")
    assert list(rows(units / "units/out")) == ["unit_1", "unit_2", "unit_3"]


def test_a_list_says_serial_operator_and_what_else_it_has(units):
    for number in (1, 2):
        give_serial(units / f"units/unit_{number}.csv", units / f"units/unit_{number}.csv", "")
    (units / "list.csv").write_text(
        "\ufefffile;serial;operator;lot\nunits/unit_2.csv;A-2;Ada;7\n\nunits/unit_1.csv;A-1;;8\n",
        encoding="utf-8",
    )
    run(units, "--operator", "Bob", targets="list.csv")
    found = rows(units / "out")
    kept = {name: (row["serial"], row["operator"], row["lot"]) for name, row in found.items()}
    assert kept == {"unit_2": ("A-2", "Ada", "7"), "unit_1": ("A-1", "Bob", "8")}
    assert tumble.Calibration.load(units / "out/unit_2.yaml").serial == "A-2"


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("file,serial\nunits/unit_1.csv,A\nunits/unit_2.csv,A\n", "line 3: serial A is also that of"),
        ("file,serial\nunits/unit_1.csv,A\nunits/unit_7.csv,B\n", "line 3: "),
        ("file,serial\n,A\n", "line 2: names no file"),
    ],
)
def test_a_mistake_in_a_list_is_named_with_its_line(units, text, part):
    (units / "list.csv").write_text(text)
    line = refusal(units / "reference.csv", units / "list.csv", "-o", units / "out")
    assert "list.csv: " in line
    assert part in line
    assert not (units / "out").exists()


@pytest.mark.parametrize(
    ("name_by", "names"),
    [
        ("folder", ["S1", "S2"]),
        ("serial", ["SN-1", "SN-2"]),
        (r"S(\d+)", ["1", "2"]),
        ("file", ["imu-1", "imu-2"]),
    ],
)
def test_targets_are_named_by_what_is_asked_for(units, name_by, names):
    for number in (1, 2):
        (units / f"rack/S{number}").mkdir(parents=True)
        shutil.move(units / f"units/unit_{number}.csv", units / f"rack/S{number}/imu.csv")
    run(units, "--name-by", name_by, targets="rack")
    assert list(rows(units / "out")) == names
    assert all((units / f"out/{name}.yaml").exists() for name in names)


@pytest.mark.parametrize(
    ("name_by", "part"),
    [("folder", "would both be named units"), ("(", "regular expression"), ("rack", "does not match")],
)
def test_names_that_cannot_be_had_are_refused(units, name_by, part):
    line = refusal(units / "reference.csv", units / "units", "--name-by", name_by, "-o", units / "out")
    assert part in line


def test_a_doubled_serial_is_refused(units):
    give_serial(units / "units/unit_3.csv", units / "units/unit_3.csv", "SN-1")
    done = run(units, code=3)
    assert "unit_3: not calibrated: states serial SN-1, which is that of unit_1" in done.text
    assert not (units / "out/unit_3.yaml").exists()
    line = refusal(units / "reference.csv", units / "units", "--name-by", "serial", "-o", units / "again")
    assert "have serial SN-1" in line


def test_targets_with_one_serial_are_refused_but_not_the_reference(units):
    line = refusal(units / "reference.csv", units / "units", "--serial", "X", "-o", units / "out")
    assert "--serial X: there are 3 targets" in line
    give_serial(units / "reference.csv", units / "reference.csv", "")
    give_serial(units / "units/unit_1.csv", units / "units/unit_1.csv", "")
    run(units, "--serial", "X", targets="units/unit_1.csv")
    found = tumble.Calibration.load(units / "out/unit_1.yaml")
    assert (found.serial, found.reference.serial) == ("X", "")


# Provenance.


def test_files_say_who_made_them_when_where_and_from_what(units, monkeypatch):
    monkeypatch.setenv("TUMBLE_STATION", "table 2")
    limits = units / "limits.yaml"
    limits.write_text("accelerometer: {bias: 5.0}\n")
    run(units, "--operator", "Ada", "--limits", limits)
    found = tumble.Calibration.load(units / "out/unit_2.yaml")
    assert (found.date, found.operator, found.station) == ("2026-11-26T00:00:00Z", "Ada", "table 2")
    log = units / "units/unit_2.csv"
    assert found.log.sha256 == hashlib.sha256(log.read_bytes()).hexdigest()
    assert found.log.file == "unit_2.csv"
    assert found.log.duration == pytest.approx(40.0, abs=1.0)
    assert found.reference.log.sha256 == hashlib.sha256((units / "reference.csv").read_bytes()).hexdigest()
    assert found.limits.accelerometer.bias.limits() == {"x": 5.0, "y": 5.0, "z": 5.0}
    assert found.verdict == "pass"
    row = rows(units / "out")["unit_2"]
    assert (row["operator"], row["station"], row["log sha256"]) == ("Ada", "table 2", found.log.sha256)
    assert float(row["duration (s)"]) == found.log.duration
    assert float(row["temperature (degC)"]) == found.temperature.mean
    page = (units / "out/unit_2.html").read_text()
    assert all(word in page for word in ("Ada", "table 2", "2026-11-26 00:00:00 UTC", found.log.sha256))


def test_the_reference_s_calibration_is_named_by_its_digest(units):
    run(units)
    of_unit = tumble.Calibration.load(units / "out/unit_1.yaml")
    of_unit.model_copy(update={"serial": ""}).save(units / "reference.yaml")
    run(units, "--reference-calibration", units / "reference.yaml", targets="units/unit_2.csv")
    applied = tumble.Calibration.load(units / "reference.yaml").hash()
    assert rows(units / "out")["unit_2"]["reference calibration sha256"] == applied
    assert rows(units / "out")["unit_1"]["reference calibration sha256"] == ""


def test_no_file_tells_a_folder_of_this_machine(units):
    (units / "units/unit_3.csv").write_text("remember the milk\n")
    poses = units / "poses.yaml"
    shutil.copy(units / "reference.csv", units / "units/zero.csv")
    SIX_FACES.save(poses)
    run(units, "--poses", poses, "--pages", "all", code=3)
    for name, content in contents(units / "out").items():
        assert str(units).encode() not in content, f"{name} names {units}"


def test_a_date_that_is_none_is_refused(units, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    assert "SOURCE_DATE_EPOCH=yesterday" in refusal(
        units / "reference.csv", units / "units", "-o", units / "out"
    )


def test_a_calibration_file_of_the_first_version_is_still_read(units):
    run(units)
    lines = (units / "out/unit_1.yaml").read_text()
    old = re.sub(r"(?m)^(date|operator|station|verdict): .*\n", "", lines)
    old = re.sub(r"(?m)^( *)log:\n(?:\1  .*\n)+", "", old)
    assert "sha256:" not in old.replace("calibration_hash", "")
    (units / "old.yaml").write_text(old)
    found = tumble.Calibration.load(units / "old.yaml")
    assert (found.date, found.log, found.limits) == ("", None, None)


# Pages, and what stands on the screen.


@pytest.mark.parametrize(("pages", "drawn"), [("all", {1, 2, 3}), ("failed", {2}), ("none", set())])
def test_pages_are_drawn_of_those_that_are_asked_for(units, pages, drawn):
    (units / "units/unit_2.csv").write_text("")
    run(units, "--pages", pages, code=3)
    found = {path.stem for path in (units / "out").glob("unit_*.html")}
    assert found == {f"unit_{number}" for number in drawn}
    page = (units / "out/turntable.html").read_text()
    assert set(re.findall(r'href="(unit_\d)\.html"', page)) == found
    assert all(f"unit_{number}" in page for number in (1, 2, 3))


def test_many_targets_get_pages_only_for_failures_with_a_notice(line, tmp_path, monkeypatch):
    monkeypatch.setattr(production, "MOST_PAGES", 11)
    done = calibrated(line / "reference.csv", line / "units", "-o", tmp_path / "out")
    assert "only those that fail get a page" in done.err
    assert not list((tmp_path / "out").glob("unit_*.html"))


def test_files_are_the_same_whatever_the_number_of_processes(line, tmp_path, monkeypatch):
    monkeypatch.setattr(production, "FEWEST_FOR_PROCESSES", 4)
    for jobs in (1, 2):
        calibrated(
            line / "reference.csv",
            line / "units",
            "--pages",
            "all",
            "--jobs",
            jobs,
            "-o",
            tmp_path / f"{jobs}",
        )
    assert contents(tmp_path / "1") == contents(tmp_path / "2")


def test_batch_without_terminal_reports_progress_every_tenth(line, tmp_path, monkeypatch):
    monkeypatch.setattr("tumble.cli.progress.FEWEST_FOR_LINES", 12)
    done = calibrated(line / "reference.csv", line / "units", "-o", tmp_path / "out")
    said = [each for each in done.err.splitlines() if " of 12 (" in each]
    assert len(said) == 10
    assert said[-1] == "tumble: 12 of 12 (100 %): 12 targets: 12 calibrated"
    quiet = calibrated(line / "reference.csv", line / "units", "-q", "-o", tmp_path / "out")
    assert quiet.out == ""
    assert " of 12 (" not in quiet.err


def test_a_warning_that_all_share_is_one_line(units):
    for number in (1, 2, 3):
        log = units / f"units/unit_{number}.csv"
        log.write_text(f"# corrected: true\n{log.read_text()}")
    done = run(units)
    assert done.text.count("the log was already corrected") == 1
    assert "3 of 3: the log was already corrected" in done.text
    assert "unit_1: the log was" not in done.text


def test_quiet_shows_only_failures_and_verbose_the_unit_of_a_warning(units):
    (units / "units/unit_2.csv").write_text("")
    done = run(units, "-q", code=3)
    assert done.out == ""
    assert done.err.startswith("tumble: unit_2: not calibrated: ")
    assert "unit_1" not in done.err.splitlines()[0]
    for number in (1, 3):
        log = units / f"units/unit_{number}.csv"
        log.write_text(f"# corrected: true\n{log.read_text()}")
    assert "2 of 3 (unit_1, unit_3): the log was already corrected" in run(units, "-v", code=3).text


def test_the_summary_opens_in_a_spreadsheet_with_one_row_a_target(units):
    run(units)
    with (units / "out/summary.csv").open(newline="", encoding="utf-8") as file:
        table = list(csv.reader(file))
    assert len(table) == 4
    assert len({len(row) for row in table}) == 1


def test_pages_are_named_where_there_are_some_only(units):
    none = run(units, "--pages", "none", targets="units/unit_2.csv")
    assert "Calibration files, summary.csv" in none.out
    every = run(units, "--pages", "all", targets="units/unit_2.csv")
    assert "Calibration files, pages, summary.csv" in every.out

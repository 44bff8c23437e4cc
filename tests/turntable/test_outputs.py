"""Outputs of a run: files that agree, rows for all, exit codes, and nothing lost."""

from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest

import tumble
from turntable_sessions import (
    calibrated,
    contents,
    one_line,
    refusal,
    rows,
    simulate,
    typed,
    write,
)

TARGETS = ("target_1", "target_2")


@pytest.fixture(scope="module")
def session():
    return simulate(81, grades=("industrial", "tactical"), bias_instability=True, g_sensitivity=True)


@pytest.fixture(scope="module")
def logs(session, tmp_path_factory):
    return write(session, tmp_path_factory.mktemp("logs"))


@pytest.fixture(scope="module")
def out(logs, tmp_path_factory):
    """Results of one good run; tests must leave them as they are."""
    folder = tmp_path_factory.mktemp("results") / "out"
    calibrated(*logs, "--g-sensitivity", "-o", folder)
    return folder


def test_a_run_writes_exactly_the_files_it_names(out):
    assert sorted(contents(out)) == sorted(
        [f"{name}.{kind}" for name in TARGETS for kind in ("yaml", "html")]
        + ["turntable.html", "summary.csv", "batch.jsonl"]
    )


def test_the_same_input_gives_the_same_files_to_the_byte(logs, out, tmp_path):
    calibrated(*logs, "--g-sensitivity", "-o", tmp_path / "again", "--jobs", 1)
    again = contents(tmp_path / "again")
    for name, content in contents(out).items():
        assert again[name] == content, f"{name} differs from one run to the next"


def test_the_rests_of_a_corrected_log_read_the_truth(session, logs, out, tmp_path):
    for unit, log in zip(session.target_units, logs[1:], strict=True):
        corrected = tmp_path / f"{unit.name}.parquet"
        done = typed("apply", out / f"{unit.name}.yaml", log, "-o", corrected)
        assert done.code == 0, done.err
        (chunk,) = tumble.open_recording(corrected).chunks()
        before = largest_miss(session, unit.samples)
        after = largest_miss(session, chunk)
        assert after["specific force"] < 0.02 * before["specific force"]
        assert after["angular rate"] < 0.1 * before["angular rate"]


def largest_miss(session, chunk):
    """Over all rests: mean reading less what is true, largest component."""
    force, rate = [], []
    for rest in session.rests:
        within = (chunk.time > rest.start + 0.3) & (chunk.time < rest.end - 0.3)
        force.append(chunk.accelerometer[within].mean(axis=0) - rest.specific_force)
        rate.append(chunk.gyroscope[within].mean(axis=0) - rest.angular_rate)
    return {"specific force": np.abs(force).max(), "angular rate": np.abs(rate).max()}


def test_a_corrected_log_is_known_to_be_corrected(logs, out, tmp_path):
    typed("apply", out / "target_1.yaml", logs[1], "-o", tmp_path / "once.csv")
    done = calibrated(logs[0], tmp_path / "once.csv", "--g-sensitivity", "-o", tmp_path / "out")
    assert "the log was already corrected" in done.text
    found = tumble.Calibration.load(tmp_path / "out/once.yaml")
    np.testing.assert_allclose(found.accelerometer.M, np.eye(3), atol=1e-6)
    # Weights follow from residuals, so that a second fit may differ by a small part of a sigma.
    sigmas = np.sqrt(np.diag(found.gyroscope.covariance))
    assert (np.abs(found.gyroscope.M - np.eye(3)).ravel() < 0.2 * sigmas[:9]).all()
    assert (np.abs(found.gyroscope.g_sensitivity) < 0.2 * found.gyroscope.g_sensitivity_sigma).all()


def test_a_calibration_file_reads_back_as_it_was_written(out, tmp_path):
    calibration = tumble.Calibration.load(out / "target_1.yaml")
    calibration.save(tmp_path / "copy.yaml")
    assert (tmp_path / "copy.yaml").read_bytes() == (out / "target_1.yaml").read_bytes()


def test_files_and_json_tell_the_same(logs, out, tmp_path):
    done = calibrated(*logs, "--g-sensitivity", "-o", tmp_path / "out", "--json")
    assert done.err == ""
    content = json.loads(done.out)
    assert [target["name"] for target in content["targets"]] == list(TARGETS)
    for target in content["targets"]:
        calibration = tumble.Calibration.load(out / f"{target['name']}.yaml")
        assert target["calibration"]["accelerometer"]["M"] == calibration.accelerometer.M.tolist()
        row = rows(out)[target["name"]]
        assert float(row["gyroscope bias y (rad/s)"]) == target["calibration"]["gyroscope"]["b"][1]
    for path in content["files"].values():
        assert (tmp_path / "out") in map(type(tmp_path), [path, *type(tmp_path)(path).parents])


def test_summary_has_a_row_a_target_in_typed_order_with_all_sigmas(logs, out, tmp_path):
    calibrated(logs[0], logs[2], logs[1], "-o", tmp_path / "out")
    assert list(rows(tmp_path / "out")) == ["target_2", "target_1"]
    row = rows(out)["target_1"]
    values = [column for column in row if column.startswith(("accelerometer ", "gyroscope "))]
    assert len(values) == 24
    for column in values:
        assert math.isfinite(float(row[column]))
        assert float(row[f"sigma {column}"]) > 0.0


def test_the_report_of_the_batch_leads_to_every_target(out):
    page = (out / "turntable.html").read_text()
    for name in TARGETS:
        assert f'href="{name}.html"' in page


def test_unreadable_target_stops_no_other_and_has_a_row_with_reason(logs, tmp_path):
    (tmp_path / "cut.csv").write_bytes(logs[1].read_bytes()[:50_001])
    (tmp_path / "note.csv").write_text("remember the milk\n")
    done = calibrated(
        logs[0], tmp_path / "cut.csv", logs[1], tmp_path / "note.csv", "-o", tmp_path / "out", code=3
    )
    found = rows(tmp_path / "out")
    assert {name: row["verdict"] for name, row in found.items()} == {
        "cut": "not calibrated",
        "target_1": "calibrated",
        "note": "not calibrated",
    }
    assert "cut.csv: line" in found["cut"]["reason"]
    assert "cut short" in found["cut"]["reason"]
    assert "not a log" in found["note"]["reason"]
    assert found["cut"]["accelerometer bias x (m/s^2)"] == ""
    assert (tmp_path / "out/target_1.yaml").exists()
    assert not (tmp_path / "out/cut.yaml").exists()
    assert "cut: not calibrated" in done.text


@pytest.mark.parametrize("corrupt", ["reference", "every target"])
def test_run_without_any_usable_target_keeps_earlier_results(logs, tmp_path, corrupt):
    calibrated(*logs[:2], "-o", tmp_path / "out")
    before = contents(tmp_path / "out")
    (tmp_path / "empty.csv").write_text("")
    pair = (tmp_path / "empty.csv", logs[1]) if corrupt == "reference" else (logs[0], tmp_path / "empty.csv")
    assert "empty.csv: is empty" in refusal(*pair, "-o", tmp_path / "out")
    assert contents(tmp_path / "out") == before


def test_every_target_that_fails_has_its_own_line(logs, tmp_path):
    for name in ("one", "two"):
        (tmp_path / f"{name}.csv").write_text("")
    done = typed("turntable", logs[0], tmp_path / "one.csv", tmp_path / "two.csv", "-o", tmp_path / "out")
    assert done.code == 2
    first, second = done.err.splitlines(keepends=True)
    assert "one.csv" in one_line(first)
    assert "two.csv" in one_line(second)


def test_limits_pass_and_fail_target_by_target(session, logs, tmp_path):
    largest = [np.abs(unit.gyroscope.b).max() for unit in session.target_units]
    assert largest[0] > 2.0 * largest[1], "the seed drew a tactical gyroscope as biased as an industrial one"
    (tmp_path / "limits.yaml").write_text(f"gyroscope: {{bias: {math.sqrt(largest[0] * largest[1]):.9f}}}\n")
    done = calibrated(
        *logs, "--g-sensitivity", "--limits", tmp_path / "limits.yaml", "-o", tmp_path / "out", code=3
    )
    found = rows(tmp_path / "out")
    assert [found[name]["verdict"] for name in TARGETS] == ["fail", "pass"]
    assert "gyroscope bias" in found["target_1"]["reason"]
    assert found["target_2"]["reason"] == ""
    assert "1 fail, 1 pass" in done.text
    assert tumble.Calibration.load(tmp_path / "out/target_1.yaml").name == "target_1"


def test_an_output_folder_below_a_file_is_refused_before_any_work(logs, tmp_path):
    (tmp_path / "notes").write_text("mine")
    line = refusal(*logs, "-o", tmp_path / "notes/out")
    assert "cannot write in this output folder" in line
    assert str(tmp_path / "notes/out") in line
    assert (tmp_path / "notes").read_text() == "mine"


def test_folder_in_the_place_of_a_result_is_refused_and_kept(logs, tmp_path):
    (tmp_path / "out/target_1.yaml").mkdir(parents=True)
    (tmp_path / "out/target_1.yaml/mine").write_text("mine")
    line = refusal(*logs[:2], "-o", tmp_path / "out")
    assert "target_1.yaml: is a folder" in line
    assert (tmp_path / "out/target_1.yaml/mine").read_text() == "mine"
    assert [path.name for path in (tmp_path / "out").iterdir() if path.name.endswith(".tmp")] == []


def test_results_in_python_say_what_the_files_say(session, out):
    result = tumble.turntable(session.reference, session.targets, g_sensitivity=True)
    for name in TARGETS:
        from_file = tumble.Calibration.load(out / f"{name}.yaml")
        np.testing.assert_allclose(result[name].accelerometer.M, from_file.accelerometer.M, atol=1e-9)
        assert name in repr(result)
        assert "accelerometer bias x" in repr(result[name])
        assert "<table" in result[name]._repr_html_()
    with pytest.raises(KeyError):
        result["target_9"]


@pytest.mark.parametrize("text", ["=cmd|'/c calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1"])
def test_no_cell_of_others_is_a_formula(tmp_path, text):
    logs = write(simulate(7, grades=("industrial",)), tmp_path)
    table = tmp_path / "targets.csv"
    with table.open("w", newline="") as file:
        csv.writer(file).writerows([["file", "serial", "note", text], [logs[1].name, text, text, "-5.5"]])
    out = tmp_path / "out"
    calibrated(logs[0], table, "--operator", text, "-o", out)
    with (out / "summary.csv").open(newline="") as file:
        head, row = csv.reader(file)
    cells = dict(zip(head, row, strict=True))
    for cell in (*head, *row):
        assert not cell.startswith(("=", "@", "\t", "\r"))
        if cell.startswith(("+", "-")):
            float(cell)
    assert cells["operator"].startswith("'")
    assert cells["operator"].replace("'", "") == text.replace("\r", " ").replace("'", "")
    assert any(cell.startswith("-") for cell in row), "numbers below zero stay numbers"

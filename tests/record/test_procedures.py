"""Procedures take a session as they take the logs that it was recorded from."""

from __future__ import annotations

import pytest
import yaml

from turntable_sessions import typed

UNITS = ("reference", "target_1", "target_2")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Logs of a turntable session, and what is recorded of them as they are replayed."""
    folder = tmp_path_factory.mktemp("bench")
    assert typed("simulate", "turntable", "--seed", "3", "-o", folder / "logs").code == 0
    words = [f"{name}=replay:{folder}/logs/{name}.csv?speed=max" for name in UNITS]
    done = typed("record", *words, "-o", folder / "session")
    assert done.code == 0, done.err
    return folder


def found(path):
    """Content of a calibration file apart from its time and source file."""
    content = yaml.safe_load(path.read_text())
    return {key: content[key] for key in ("name", "serial", "accelerometer", "gyroscope")}


def test_a_turntable_session_gives_what_its_logs_give_to_the_bit(folder, tmp_path):
    logs = [folder / "logs" / f"{name}.csv" for name in UNITS]
    assert typed("turntable", *logs, "-o", tmp_path / "logs").code == 0
    done = typed("turntable", folder / "session", "-o", tmp_path / "session")
    assert done.code == 0, done.err
    for name in UNITS[1:]:
        assert found(tmp_path / "session" / f"{name}.yaml") == found(tmp_path / "logs" / f"{name}.yaml")


def test_the_unit_that_is_named_is_the_reference(folder, tmp_path):
    # It shows that by refusing it: that of the name reference is the better one here.
    done = typed("turntable", folder / "session", "--reference", "target_1", "-o", tmp_path)
    assert done.code == 2
    assert "reference is quieter than the reference target_1" in done.err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("session", "--reference", "nobody"), "no unit 'nobody'; say --reference NAME, one of reference"),
        (("session:target_1",), "give REFERENCE and one or more TARGETs, or a recorded session"),
        (("logs/reference.csv", "--reference", "reference"), "or a recorded session and --reference NAME"),
    ],
)
def test_missing_reference_is_refused_in_one_line(folder, monkeypatch, words, says):
    monkeypatch.chdir(folder)
    done = typed("turntable", *words)
    assert done.code == 2
    assert says in done.err


def test_session_units_are_a_redundant_set_with_the_first_as_primary(folder, tmp_path):
    done = typed("redundancy", folder / "session", "--json", "-o", tmp_path / "session")
    assert done.code in (0, 3), done.err
    named = typed(
        "redundancy",
        *(folder / "session", "--primary", UNITS[0], "--secondary", UNITS[1], "--secondary", UNITS[2]),
        *("--json", "-o", tmp_path / "named"),
    )
    events = [(tmp_path / name / "events.jsonl").read_bytes() for name in ("session", "named")]
    assert events[0] == events[1] != b""
    assert named.code == done.code

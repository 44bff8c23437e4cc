"""Names and serial numbers may be no UTF-8: all commands take them, and all formats write them escaped."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calibrated_commands import CALIBRATED
from made_up_calibrations import made_up, save
from tumble.cli.read_options import read_options_for
from tumble.foundation.log_formats import stem_of
from tumble.foundation.names import normal_name
from tumble.foundation.words import in_utf8, plain, printable, utf8
from tumble.logs import ReadOptions, open_recording
from tumble.tools.convert.procedure import EUROC, TARGETS
from typed_commands import typed

NAME = os.fsdecode(b"rob\xe9t\xff")
SHOWN = r"rob\xe9t\xff"
WORN = ("--operator", NAME, "--station", NAME, "--serial", NAME)
FOR_VIEWERS = ("--mcap", "a.mcap", *(("--rerun", "a.rrd") if sys.version_info >= (3, 11) else ()))
OF_LOGS = {
    **{name: words for name, words in CALIBRATED.items() if name not in ("view", "apply")},
    "align": lambda log, other, known: ("--primary", log, "--secondary", other),
    "redundancy": lambda log, other, known: ("--primary", log, "--secondary", other),
}
any_text = st.text(st.characters(exclude_categories=()) | st.characters(categories=["Cs"]), max_size=20)


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """Logs of two units that move alike and one at rest, and a calibration, by such names."""
    monkeypatch.chdir(tmp_path)
    random, time = np.random.default_rng(5), np.arange(0.0, 6.0, 0.01)
    rates = np.column_stack([np.sin(time * pace) for pace in (3.0, 4.1, 5.3)])
    for name, motion in ((NAME, 1.0), (f"{NAME}2", 1.0), (f"{NAME}3", 0.0)):
        rows = np.column_stack([time, random.normal([0.0, 0.0, 9.8], 0.02, (600, 3)), motion * rates])
        rows[:, 4:] += random.normal(0.0, 0.002, (600, 3))
        head = "time,ax,ay,az,gx,gy,gz"
        np.savetxt(f"{name}.csv", rows, "%.9g", ",", header=head, comments="")
    save(tmp_path, made_up(serial="1", log="1"))
    Path("result_0.yaml").rename(f"{NAME}.yaml")
    return tmp_path


@given(any_text)
def test_no_name_and_no_shown_text_holds_what_cannot_be_encoded(text):
    for written in (normal_name, plain, printable, in_utf8):
        written(text).encode()
    stem_of(Path(f"_{text}")).encode()
    assert ReadOptions(serial=text).serial == normal_name(text)
    assert in_utf8(text).encode() == utf8(text)


def test_bytes_are_shown_one_way():
    assert normal_name(NAME) == plain(NAME) == printable(NAME) == in_utf8(NAME) == SHOWN


@pytest.mark.parametrize("command", OF_LOGS)
def test_every_command_takes_such_names(workplace, command):
    words = OF_LOGS[command](f"{NAME}.csv", f"{NAME}2.csv", f"{NAME}.yaml")
    given = {path.name for path in workplace.iterdir()}
    done = typed(command, *words, *WORN, *FOR_VIEWERS, "-o", "out", "--json")
    assert done.code in (0, 2, 3), done
    in_utf8(done.out + done.err).encode()
    for path in workplace.rglob("*"):
        if path.name not in given and path.suffix in (".yaml", ".json", ".jsonl", ".csv", ".html"):
            path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "words",
    [
        ("noise", f"{NAME}3.csv"),
        ("align", "--primary", f"{NAME}.csv", "--secondary", f"{NAME}2.csv"),
        ("redundancy", "--primary", f"{NAME}.csv", "--secondary", f"{NAME}2.csv"),
    ],
    ids=lambda words: words[0],
)
def test_results_show_the_bytes_escaped(workplace, words):
    assert typed(*words, *FOR_VIEWERS, "-o", "out").code in (0, 3)
    pages = list(Path("out").glob("*.html"))
    assert len(pages) == 1
    assert SHOWN in pages[0].read_text(encoding="utf-8")
    assert all(Path(name).stat().st_size for name in FOR_VIEWERS[1::2])


@pytest.mark.parametrize("format_name", TARGETS)
def test_every_format_is_written_with_such_a_serial(workplace, format_name):
    with h5py.File("serial.h5", "w") as file:
        table = np.loadtxt(f"{NAME}.csv", delimiter=",", skiprows=1)
        columns = {"time": table[:, 0], "accelerometer": table[:, 1:4], "gyroscope": table[:, 4:]}
        for name, values in columns.items():
            file[name] = values
        file.attrs.create("serial", os.fsencode(NAME), dtype=h5py.string_dtype())
    for output, *words in (("a", "serial.h5"), ("b", f"{NAME}.csv", "--serial", NAME)):
        place = f"{output}.{format_name}"
        assert typed("convert", *words, "--format", format_name, "-o", place).code == 0
        if format_name != EUROC:
            assert open_recording(place).metadata.serial == SHOWN


def test_an_option_for_one_log_names_it_as_typed_or_shown(workplace):
    for name in (NAME, SHOWN):
        options = read_options_for(ReadOptions(), [f"{name}:serial=7"], [f"{NAME}.csv", f"{NAME}2.csv"])
        assert [each.serial for each in options.values()] == ["7", ""]

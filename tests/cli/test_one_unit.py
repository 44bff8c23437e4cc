"""All that is taken together for one unit is of one unit, or is refused by the two serial numbers."""

from __future__ import annotations

import pytest
import typer

from calibrated_commands import CALIBRATED, SEVERAL, write_log
from made_up_calibrations import made_up
from tumble.cli.commands import COMMANDS, command_line
from turntable_sessions import one_line, typed
from typed_commands import commands_below

APART = {
    *("turntable", "redundancy", "compare", "export", "inspect", "view", "record"),
    *("registry add", "registry due", "certificate issue", "certificate verify"),
}
"""Commands that take several arguments, each for a unit of its own."""


@pytest.fixture(scope="module")
def commands():
    return dict(commands_below(typer.main.get_command(command_line(list(COMMANDS)))))


@pytest.fixture
def files(tmp_path):
    """A log of unit SN-2, one of unit SN-3, and a calibration of unit SN-1."""
    made_up("SN-1").save(tmp_path / "known.yaml")
    return (
        write_log(tmp_path / "log.csv", "SN-2"),
        write_log(tmp_path / "b.csv", "SN-3"),
        tmp_path / "known.yaml",
    )


def test_each_command_with_a_calibration_is_in_the_law(commands):
    options = {"--calibration", "--reference-calibration", "calibration"}
    having = {
        name
        for name, command in commands.items()
        if any(options.intersection(parameter.opts) for parameter in command.params)
    }
    assert having == set(CALIBRATED)


def test_each_command_with_several_arguments_is_in_the_law(commands):
    several = {
        name
        for name, command in commands.items()
        if any(each.param_type_name == "argument" and each.nargs == -1 for each in command.params)
    }
    assert several == set(SEVERAL) | APART


@pytest.mark.parametrize("command", CALIBRATED)
def test_a_calibration_of_another_unit_is_refused(command, files, tmp_path):
    output = (
        () if command == "view" else ("-o", tmp_path / "out" if command != "apply" else tmp_path / "x.csv")
    )
    done = typed(command, *CALIBRATED[command](*files), *output)
    assert done.code == 2, done.out + done.err
    line = one_line(done.err)
    assert "is of unit" in line
    assert "SN-1" in line
    assert "SN-2" in line or command == "view"
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize("command", SEVERAL)
def test_logs_of_two_units_are_not_taken_for_one(command, files, tmp_path):
    given = files[:2]
    if SEVERAL[command] == "calibrations":
        given = [tmp_path / f"{serial}.yaml" for serial in ("SN-2", "SN-3")]
        for path in given:
            made_up(path.stem).save(path)
    done = typed(command, *given, "-o", tmp_path / "out")
    assert done.code == 2, done.out + done.err
    assert f"are of units SN-2 and SN-3; give {SEVERAL[command]} of one unit" in one_line(done.err)

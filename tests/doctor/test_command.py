"""`tumble doctor` reports of each part whether it works and the remedy, whatever is broken."""

from __future__ import annotations

import importlib
import json
import os
import sys
from importlib import metadata
from pathlib import Path

import pytest

import tumble
from iio_fixtures import ImitatedDevice, axes
from tumble.tools.doctor import libraries, procedure, terminal
from tumble.tools.doctor.libraries import Requirement, library
from tumble.tools.doctor.procedure import diagnose
from tumble.tools.doctor.result import State
from turntable_sessions import typed


def found(diagnosis, part):
    """Finding on a part."""
    (finding,) = (each for section in diagnosis.sections for each in section.findings if each.part == part)
    return finding


def section(diagnosis, start):
    (named,) = (each for each in diagnosis.sections if each.name.startswith(start))
    return named


def test_installation_in_order_is_reported_to_work():
    done = typed("doctor")
    assert (done.code, done.err) == (0, "")
    assert f"tumble: works: {tumble.__version__}" in done.out
    assert done.out.rstrip().endswith("Tumble works.")


def test_json_output_holds_the_same():
    done = typed("doctor", "--json")
    content = json.loads(done.out)
    assert content["works"] is True
    shown = typed("doctor").out
    for findings in content["sections"].values():
        for each in findings:
            assert f"{each['part']}: {each['state']}: " in shown


def test_each_library_that_is_needed_is_looked_at_once():
    needed = {each.name for each in libraries.requirements() if not each.extra}
    findings = section(diagnose(), "Libraries").findings
    assert {"numpy", "pyarrow", "typer"} <= needed == {each.part for each in findings}
    assert len(findings) == len(needed)


def test_library_of_an_extra_is_optional_even_if_another_extra_asks(monkeypatch):
    asked = ["zebra[stripes]>=1,<2 ; extra == 'lint'", "numpy>=1.26"]
    monkeypatch.setattr(metadata, "requires", lambda name: asked)
    assert next(iter(libraries.requirements())) == Requirement("zebra", ">=1,<2", "lint")
    assert diagnose().works


@pytest.mark.parametrize("extra", ["live", "formats"])
def test_a_library_that_is_missing_is_named_with_what_to_type(monkeypatch, extra):
    asked = [f'zebra>=1; extra == "{extra}"', "numpy>=1.26"]
    monkeypatch.setattr(metadata, "requires", lambda name: asked)
    diagnosis = diagnose()
    finding = found(diagnosis, "zebra")
    assert (finding.state, finding.what) == (State.MISSING, "not installed")
    assert finding.remedy == f"python -m pip install 'tumble-imu[{extra}]'"
    assert diagnosis.works


def test_a_needed_library_of_a_version_that_will_not_do_is_broken(monkeypatch):
    monkeypatch.setattr(metadata, "requires", lambda name: ["numpy<1.0"])
    diagnosis = diagnose()
    assert found(diagnosis, "numpy").what.endswith("; needed is <1.0")
    assert not diagnosis.works


@pytest.mark.parametrize("error", [ImportError("GLIBC_2.40 not found"), RuntimeError("a\nb"), SystemError()])
def test_library_that_fails_to_import_is_broken_without_a_traceback(monkeypatch, error):
    def refuses(name):
        raise error

    monkeypatch.setattr(libraries, "import_module", refuses)
    finding = library(Requirement("numpy", "", ""), "install it again")
    assert finding.state is State.BROKEN
    assert "import numpy: " in finding.what
    assert "\n" not in finding.what


def test_unloadable_native_module_is_reported_with_exit_code_3(monkeypatch):
    real = importlib.import_module

    def without(name, *rest):
        if name == "tumble._core":
            raise ImportError("wrong ELF class")
        return real(name, *rest)

    monkeypatch.setattr(procedure, "import_module", without)
    done = typed("doctor")
    assert done.code == 3
    assert "Tumble: broken: ImportError: wrong ELF class; python -m pip install --force-reinstall" in done.out
    assert "numpy: works" in done.out


def test_a_native_module_of_another_version_is_broken(monkeypatch):
    monkeypatch.setattr(tumble._core, "__version__", "0.0.9")
    finding = found(diagnose(), "native module")
    assert (finding.state, finding.what.split(",")[0]) == (State.BROKEN, "0.0.9")


def test_unreadable_serial_port_is_reported_with_the_group_to_join(tmp_path, monkeypatch):
    (tmp_path / "dev").mkdir()
    port = tmp_path / "dev" / "ttyUSB0"
    port.touch()
    assert found(diagnose(tmp_path), str(port)).state is State.WORKS
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    finding = found(diagnose(tmp_path), str(port))
    assert finding.state is State.REFUSED
    assert "dialout" in finding.remedy


def test_sensor_of_linux_is_found_with_its_permission(tmp_path, monkeypatch):
    device = ImitatedDevice(tmp_path, 0, "lsm6dsm", axes("in_accel", "le:s16/16>>0", 0))
    try:
        assert found(diagnose(tmp_path), "iio:device0").state is State.WORKS
        monkeypatch.setattr(os, "access", lambda path, mode: False)
        finding = found(diagnose(tmp_path), "iio:device0")
    finally:
        device.close()
    assert finding.state is State.REFUSED
    assert "udev" in finding.remedy


def test_missing_devices_are_reported(tmp_path):
    diagnosis = diagnose(tmp_path)
    assert found(diagnosis, "serial ports").state is State.MISSING
    assert found(diagnosis, "IIO devices").state is State.MISSING
    assert diagnosis.works


@pytest.mark.parametrize("shell", terminal.COMPLETIONS)
def test_completion_is_missing_until_its_file_is_there(tmp_path, monkeypatch, shell):
    monkeypatch.setenv("SHELL", f"/bin/{shell}")
    assert found(diagnose(home=tmp_path), "completion").remedy == "tumble --install-completion"
    file = tmp_path / terminal.COMPLETIONS[shell]
    file.parent.mkdir(parents=True)
    file.touch()
    assert found(diagnose(home=tmp_path), "completion").state is State.WORKS


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_file_of_completion_is_where_the_command_line_puts_it(tmp_path, monkeypatch, shell):
    from typer import _completion_shared

    monkeypatch.setenv("HOME", str(tmp_path))
    _, path = _completion_shared.install(shell=shell, prog_name="tumble", complete_var="_TUMBLE_COMPLETE")
    assert path == tmp_path / terminal.COMPLETIONS[shell]


def test_screen_without_the_signs_of_results_is_reported(monkeypatch):
    class Ascii:
        encoding = "ascii"

        def isatty(self):
            return True

    monkeypatch.setattr(sys, "stdout", Ascii())
    (finding, *_) = terminal.terminal(Path("nowhere"))
    assert finding.state is State.BROKEN
    assert "UTF-8" in finding.remedy

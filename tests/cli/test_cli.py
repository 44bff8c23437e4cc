"""The command line: help, exit codes, and one line for every mistake."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
import types
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
import typer
import yaml

import made_up_batch as made_up
from tumble.calibration.document import Calibration
from tumble.cli import main as command_line
from tumble.cli.commands import COMMANDS
from tumble.foundation.errors import ProcedureError
from tumble.foundation.provenance import Provenance
from tumble.procedures.turntable.command import turntable_command
from typed_commands import typed

FAULTY = {"accelerometer": {"bias": 1e-9}}


def tumble(*arguments, **options):
    """Runs the command as a user does."""
    command = [sys.executable, "-c", "from tumble.cli.main import main; main()", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs the command in this process, so that a procedure can be put in its place."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["tumble", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            command_line.main()
        captured = capsys.readouterr()
        return types.SimpleNamespace(code=caught.value.code or 0, out=captured.out, err=captured.err)

    return run


@pytest.fixture
def recordings(tmp_path):
    """Three short logs; what is in them does not matter to the tests here."""
    paths = []
    for name in ("reference", "target_1", "target_2"):
        path = tmp_path / f"{name}.csv"
        rows = [f"{0.01 * i},0.1,-0.2,9.8{i % 10},0.00{i % 7},0.0{i % 3},0.001" for i in range(400)]
        path.write_text("time,ax,ay,az,gx,gy,gz\n" + "\n".join(rows) + "\n")
        paths.append(path)
    return paths


class MadeUpSession:
    """Finds of each target, in their order, what the test made up."""

    def __init__(self, result, asked):
        self.batch = replace(result, targets=())
        self.provenance = Provenance()
        self._asked = asked
        self._targets = result.targets

    def acquire(self, source, read):
        self._asked.setdefault("targets", []).append(source)
        return ProcedureError("not read")

    def why_swapped(self, unit):
        return ""

    def calibrate(self, name, unit, provenance):
        made = {target.name: target for target in self._targets}
        return made.get(name) or replace(self._targets[0], name=name)


@pytest.fixture
def procedure(monkeypatch):
    """A procedure that finds what the test made up, and keeps what it was asked for."""
    asked = {}

    def put(result):
        def open_session(reference, **options):
            asked.update(options, reference=reference)
            if isinstance(result, BaseException):
                raise result
            return MadeUpSession(result, asked)

        monkeypatch.setattr(
            import_module("tumble.procedures.turntable.procedure"), "open_session", open_session
        )
        return asked

    return put


def test_help_lists_every_command():
    done = tumble("--help")
    assert done.returncode == 0
    for name in COMMANDS:
        assert name in done.stdout


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_the_help_of_every_command_has_an_example(name, run):
    words = {
        "simulate": ("simulate", "turntable"),
        "table": ("table", "goto"),
        "registry": ("registry", "add"),
        "fleet": ("fleet", "run"),
    }.get(name, (name,))
    done = run(*words, "--help")
    assert done.code == 0, done.err
    assert f"tumble {' '.join(words)} " in " ".join(done.out.replace("Usage: ", "").split())
    assert "Example" in done.out


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_the_list_of_commands_says_what_the_command_itself_says(name):
    entry = COMMANDS[name]
    found = entry.load()
    text = found.info.help if isinstance(found, typer.Typer) else found.__doc__
    assert text.splitlines()[0] == entry.summary


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("turntable",), "missing argument 'REFERENCE'; see tumble turntable --help"),
        (("apply", "unit.yaml"), "missing argument 'LOG'; see tumble apply --help"),
        (("align",), "missing option '--primary'; see tumble align --help"),
        (("nothing",), "no such command 'nothing'; see tumble --help"),
        (("simulate", "spin", "--seed", "x"), "invalid value for '--seed': 'x' is not a valid int"),
        (("simulate", "spin", "--seed"), "option '--seed' requires an argument"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_wrong_command_line_is_reported_in_one_line(run, words, line):
    done = run(*words)
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith(f"tumble: error: {line}")
    assert done.err.count("\n") == 1


def test_a_command_of_commands_alone_shows_its_help(run):
    for words in ((), ("simulate",)):
        done = run(*words)
        assert done.code == 2
        assert "Usage: tumble" in done.out + done.err
        assert "error" not in done.out + done.err


LIBRARIES = {
    "jinja2",
    "mcap",
    "numpy",
    "pandas",
    "pyarrow",
    "pyarrow.compute",
    "pydantic",
    "pymavlink",
    "rosbags",
    "scipy",
    "serial",
    "yaml",
}
"""Libraries that only some commands need."""


def libraries_of(*arguments, **variables):
    """Runs the command; returns what it prints, and which of `LIBRARIES` it imports."""
    command = "import sys; sys.argv[0] = 'tumble'; from tumble.cli.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-c", command, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **variables},
    )
    imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    return done.stdout, LIBRARIES & imported


HELP_OF_EACH = """
import contextlib, io, sys
from tumble.cli.main import main
libraries, commands = (each.split(",") for each in sys.argv[1:])
for command in commands:
    sys.argv = ["tumble", command, "--help"]
    with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()) as shown:
        main()
    assert "Usage: tumble" in shown.getvalue(), command
    if found := {*libraries} & {*sys.modules}:
        sys.exit(f"tumble {command} --help imports {found}")
"""


def test_help_of_no_command_imports_what_computes():
    """One process shows all of them: none may import it, whatever was shown before."""
    words = (",".join(LIBRARIES), ",".join(command for command in COMMANDS if command != "simulate"))
    done = subprocess.run([sys.executable, "-c", HELP_OF_EACH, *words], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_list_of_commands_imports_nothing_that_computes():
    _, libraries = libraries_of("--help")
    assert not libraries


def test_completion_imports_nothing_that_computes():
    words = "tumble inspect --accel"
    typed = {"_TYPER_COMPLETE_ARGS": words, "COMP_WORDS": words, "COMP_CWORD": "2"}
    shown, libraries = libraries_of(_TUMBLE_COMPLETE="complete_bash", **typed)
    assert "--accelerometer-unit" in shown.splitlines()
    assert not libraries


def test_a_table_is_inspected_with_numpy_and_arrow_alone(tmp_path):
    log = tmp_path / "small.csv"
    rows = "".join(f"{0.01 * k:.2f},0,0,9.81,0,0,{0.001 * (k % 3)}\n" for k in range(500))
    log.write_text(f"time,ax,ay,az,gx,gy,gz\n{rows}")
    shown, libraries = libraries_of("inspect", log)
    assert "500 samples" in shown
    assert libraries == {"numpy", "pyarrow"}


def test_the_version_is_that_of_the_package():
    done = tumble("--version")
    assert done.returncode == 0
    assert done.stdout.startswith("tumble 0.")


def test_the_package_runs_as_the_command_does():
    def run(*arguments):
        command = [sys.executable, "-m", "tumble", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    assert run("--version").stdout == tumble("--version").stdout
    assert run("inspect", "absent.csv").returncode == 2


def test_an_unknown_command_is_a_mistake_of_the_user():
    done = tumble("turntabel")
    assert done.returncode == 2
    assert "turntable" in done.stderr


def test_a_shell_can_complete_the_options_of_a_command():
    import os

    environment = {**os.environ, "_TUMBLE_COMPLETE": "complete_bash", "COMP_CWORD": "2"}
    environment["COMP_WORDS"] = "tumble turntable --tr"
    command = [
        sys.executable,
        "-c",
        "import sys; sys.argv = ['tumble']; from tumble.cli.main import main; main()",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert "--truth" in done.stdout, done.stderr


@pytest.mark.parametrize(
    "stated",
    [
        {},
        {"COMP_WORDS": "tumble"},
        {"COMP_CWORD": "1"},
        *({"COMP_WORDS": "tumble", "COMP_CWORD": number} for number in ("x", "", "1.5", "9" * 5000)),
    ],
)
def test_nothing_is_completed_where_a_shell_states_nothing(monkeypatch, stated):
    monkeypatch.setenv("_TUMBLE_COMPLETE", "complete_bash")
    for name in ("COMP_WORDS", "COMP_CWORD"):
        monkeypatch.delenv(name, raising=False)
    for name, value in stated.items():
        monkeypatch.setenv(name, value)
    done = typed()
    assert (done.code, done.out, done.err) == (0, "", "")


def test_a_missing_log_is_one_line_and_leaves_no_folder(run, tmp_path, recordings, procedure):
    procedure(made_up.batch())
    done = run("turntable", recordings[0], tmp_path / "gone.csv", "-o", tmp_path / "out")
    assert done.code == 2
    assert done.err.startswith("tumble: error: ")
    assert "gone.csv" in done.err
    assert done.err.count("\n") == 1
    assert done.out == ""
    assert not (tmp_path / "out").exists()


def test_every_result_is_written_and_named(run, tmp_path, recordings, procedure):
    procedure(made_up.batch(made_up.target("target_1", seed=1), made_up.target("target_2", seed=2)))
    out = tmp_path / "results" / "today"
    done = run("turntable", *recordings, "-o", out)
    assert done.code == 0, done.err
    written = sorted(path.name for path in out.iterdir())
    assert written == [
        "batch.jsonl",
        "summary.csv",
        "target_1.html",
        "target_1.yaml",
        "target_2.html",
        "target_2.yaml",
        "turntable.html",
    ]
    assert Calibration.load(out / "target_2.yaml").serial == "SN-2"
    assert f"Report: {out / 'turntable.html'}" in done.out
    assert "target_1" in done.out
    assert "Calibrated" in done.out


def test_options_reach_the_procedure(run, tmp_path, recordings, procedure):
    asked = procedure(made_up.batch())
    limits = tmp_path / "limits.yaml"
    limits.write_text(yaml.safe_dump(FAULTY))
    done = run(
        *("turntable", *recordings, "-o", tmp_path / "out", "--poses", "none", "--truth", "rotate-truth"),
        *("--latitude", 48.1, "--height", 520, "--limits", limits, "--clock", "apart", "--g-sensitivity"),
        *("--jobs", 2, "--accelerometer-unit", "g"),
    )
    assert done.code == 0, done.err
    assert asked["poses"] is None
    assert asked["truth"] == "rotate-truth"
    assert (asked["latitude"], asked["height"], asked["gravity"]) == (48.1, 520.0, None)
    assert asked["limits"].accelerometer.bias.x == 1e-9
    assert (asked["clock"], asked["g_sensitivity"]) == ("apart", True)
    # Targets are read at the same time, so in any order.
    assert [asked["reference"], *sorted(asked["targets"])] == [str(path) for path in recordings]
    assert asked["read"].accelerometer_unit == "g"


def test_six_faces_are_the_poses_where_none_are_given(run, tmp_path, recordings, procedure):
    asked = procedure(made_up.batch())
    run("turntable", *recordings, "-o", tmp_path / "out")
    assert [pose.name for pose in asked["poses"]][:2] == ["X up", "X down"]


def test_target_outside_its_limits_exits_3_and_is_named_with_reason(run, tmp_path, recordings, procedure):
    from tumble.calibration.limits import Limits

    bad = made_up.target("target_2", seed=2)
    bad = made_up.target("target_2", seed=2, checks=Limits.model_validate(FAULTY).check(bad))
    procedure(made_up.batch(made_up.target("target_1"), bad))
    done = run("turntable", *recordings, "-o", tmp_path / "out")
    assert done.code == 3
    assert "target_2: fail: accelerometer bias" in " ".join(done.out.split())
    assert (tmp_path / "out/target_2.yaml").exists()


def test_a_target_that_cannot_be_calibrated_does_not_stop_the_others(run, tmp_path, recordings, procedure):
    moved = made_up.target(
        "target_2", failure="it moved during every rest", accelerometer=None, gyroscope=None
    )
    procedure(made_up.batch(made_up.target("target_1"), moved))
    done = run("turntable", *recordings, "-o", tmp_path / "out")
    assert done.code == 3
    assert "target_2: not calibrated: it moved during every rest" in " ".join(done.out.split())
    assert (tmp_path / "out/target_1.yaml").exists()
    assert not (tmp_path / "out/target_2.yaml").exists()


def test_the_summary_has_one_row_a_target_and_every_digit(run, tmp_path, recordings, procedure):
    first = made_up.target("target_1", gyroscope=made_up.triad("gyroscope", bias_only=True))
    moved = made_up.target("target_2", failure="it moved", accelerometer=None, gyroscope=None)
    procedure(made_up.batch(first, moved))
    run("turntable", *recordings, "-o", tmp_path / "out")
    with (tmp_path / "out/summary.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["target"] for row in rows] == ["target_1", "target_2"]
    assert [row["verdict"] for row in rows] == ["calibrated", "not calibrated"]
    assert rows[1]["reason"] == "it moved"
    bias = float(rows[0]["accelerometer bias x (m/s^2)"])
    assert bias == first.accelerometer.b[0]
    assert float(rows[0]["sigma accelerometer bias x (m/s^2)"]) == 1e-3
    assert float(rows[0]["gyroscope bias z (rad/s)"]) == first.gyroscope.b[2]
    assert rows[0]["gyroscope scale x"] == "", "a number was given for what the data did not show"
    assert rows[1]["accelerometer bias x (m/s^2)"] == ""


def test_json_is_all_that_is_printed_and_knows_no_nan(run, tmp_path, recordings, procedure):
    target = made_up.target(gyroscope=made_up.triad("gyroscope", bias_only=True))
    procedure(made_up.batch(target))
    done = run("turntable", *recordings, "-o", tmp_path / "out", "--json")
    content = json.loads(done.out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    found = content["targets"][0]
    assert found["verdict"] == "calibrated"
    np.testing.assert_array_equal(found["calibration"]["accelerometer"]["M"], target.accelerometer.M)
    assert content["files"]["report"] == str(tmp_path / "out/turntable.html")


@pytest.mark.parametrize(
    ("options", "part"),
    [
        (["--gravity", "9.8", "--latitude", "48"], "--gravity and --latitude"),
        (["--height", "500"], "--height needs --latitude"),
        (["--poses", "gone.yaml"], "gone.yaml: no such pose list"),
        (["--limits", "gone.yaml"], "gone.yaml: no such limits file"),
        (["--reference-calibration", "gone.yaml"], "gone.yaml: no such calibration file"),
    ],
)
def test_a_wrong_option_is_one_line_before_any_work(run, tmp_path, recordings, procedure, options, part):
    procedure(AssertionError("the procedure was started"))
    done = run("turntable", *recordings, "-o", tmp_path / "out", *options)
    assert done.code == 2
    assert part in done.err
    assert done.err.count("\n") == 1


def test_a_wrong_choice_is_refused_with_the_right_ones(run, tmp_path, recordings):
    done = run("turntable", *recordings, "-o", tmp_path / "out", "--truth", "guess")
    assert done.code == 2
    assert "rotate-measurement" in done.err


def test_unwritable_output_folder_stops_before_the_work(run, tmp_path, recordings, procedure):
    procedure(AssertionError("the procedure was started"))
    (tmp_path / "out").write_text("a file of mine")
    done = run("turntable", *recordings, "-o", tmp_path / "out")
    assert done.code == 2
    assert "cannot write in this output folder" in done.err
    assert (tmp_path / "out").read_text() == "a file of mine"


def test_a_failed_run_leaves_the_results_of_the_last_one(run, tmp_path, recordings, procedure):
    procedure(made_up.batch())
    out = tmp_path / "out"
    assert run("turntable", *recordings, "-o", out).code == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    procedure(ProcedureError("reference: only 2 rests found, 4 needed; record each pose for 10 s"))
    done = run("turntable", *recordings, "-o", out)
    assert done.code == 2
    assert done.err == "tumble: error: reference: only 2 rests found, 4 needed; record each pose for 10 s\n"
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_a_bug_keeps_its_traceback(run, tmp_path, recordings, procedure):
    procedure(ZeroDivisionError("a bug of ours"))
    with pytest.raises(ZeroDivisionError):
        run("turntable", *recordings, "-o", tmp_path / "out")


def test_an_interrupted_run_exits_with_130(run, tmp_path, recordings, procedure):
    procedure(KeyboardInterrupt())
    assert run("turntable", *recordings, "-o", tmp_path / "out").code == 130


def test_the_command_is_documented_where_it_is_defined():
    assert "Example: tumble turntable" in turntable_command.__doc__

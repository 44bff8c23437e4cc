"""The checks of the repository detect breaches, and the repository passes them."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def script(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def layers(tmp_path, monkeypatch):
    """The layer check, looking at a package made up by the test: file name to source."""
    module = script("check_layers")
    package = tmp_path / "python" / "tumble"
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "PACKAGE", package)

    def breaches(files):
        for name, source in files.items():
            path = package / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(source)
        return list(module.python_breaches())

    return breaches


@pytest.mark.parametrize(
    ("file", "source", "breach"),
    [
        (
            "logs/csv.py",
            "from tumble.procedures.spin.procedure import spin",
            "logs may not import tumble.procedures.spin.procedure",
        ),
        (
            "foundation/recording.py",
            "def read():\n    from tumble import _core",
            "recording.py:2: recording may not import tumble._core",
        ),
        ("logs/csv.py", "from ..report import pages", "logs may not import tumble.report"),
        ("logs/csv.py", "import tumble.calibration.document", "logs may not import tumble.calibration"),
        ("report/svg.py", "from tumble import logs", "report may not import tumble.logs"),
        ("procedures/spin/report/page.py", "from tumble.logs import csv", "page may not import tumble.logs"),
        (
            "procedures/spin/report/page.py",
            "from ..procedure import spin",
            "page may not import tumble.procedures.spin.procedure",
        ),
        (
            "procedures/spin/procedure.py",
            "from tumble.cli import screen",
            "procedure may not import tumble.cli",
        ),
        (
            "foundation/recording.py",
            "from tumble.foundation.results import Rest",
            "recording may not import tumble.foundation.results",
        ),
        (
            "procedures/spin/result.py",
            "from tumble.procedures.spin.report import page",
            "result may not import tumble.procedures.spin.report",
        ),
        ("procedures/turntable/command.py", "import numpy as np", "no mathematics"),
        ("cli/screen.py", "import tumble", "imports the whole of tumble"),
        ("attic.py", "", "has no place in the layers"),
        ("tools/attic/procedure.py", "", "has no place in the layers"),
    ],
)
def test_an_import_that_points_down_the_page_is_found(layers, file, source, breach):
    found = layers({file: source})
    assert len(found) == 1
    assert breach in found[0]


@pytest.mark.parametrize(
    ("file", "source"),
    [
        (
            "procedures/turntable/procedure.py",
            "from tumble import _core\nfrom tumble.logs import open_recording",
        ),
        (
            "procedures/turntable/command_batch.py",
            "from tumble.calibration.limits import Limits\nimport typer",
        ),
        ("logs/csv.py", "from tumble.logs.units import UNITS\nfrom . import spec\nimport numpy"),
        ("procedures/spin/result.py", "def html():\n    from tumble.procedures.spin.report import notebook"),
    ],
)
def test_an_import_that_points_up_the_page_is_fine(layers, file, source):
    assert layers({file: source}) == []


@pytest.mark.parametrize("within", ["", "def read():\n    "])
def test_folders_that_import_each_other_around_are_found(layers, within):
    around = {
        "procedures/spin/live.py": "from tumble.procedures.align import samples",
        "procedures/align/samples.py": f"{within}import tumble.procedures.noise.curve",
        "procedures/noise/curve.py": "from tumble.procedures.spin import result",
        "procedures/thermal/live.py": "from tumble.procedures.spin import live",
    }
    (circle,) = layers(around)
    assert in_circle(circle) == {"procedures/spin", "procedures/align", "procedures/noise"}


def test_rooms_that_import_each_other_around_are_found(layers):
    around = {
        "procedures/spin/live.py": "from tumble.tools.record import writer",
        "tools/table/plan.py": "from tumble.procedures.turntable import result",
    }
    (circle,) = layers(around)
    assert in_circle(circle) == {"procedures", "tools"}


def in_circle(breach):
    start = "these import each other around: "
    assert breach.startswith(start)
    return set(breach.removeprefix(start).split(" <- "))


def test_every_import_of_the_package_points_up_the_page():
    assert list(script("check_layers").python_breaches()) == []


def test_a_type_has_one_name_in_the_whole_package():
    assert list(script("check_layers").name_breaches()) == []


def test_a_name_of_two_types_is_found(tmp_path):
    (tmp_path / "a.py").write_text("class Row:\n    pass\n\n\nclass _Mine:\n    pass\n")
    (tmp_path / "b.py").write_text("Row: TypeAlias = dict\n\n\nclass _Mine:\n    pass\n")
    (breach,) = script("check_layers").name_breaches(tmp_path)
    assert breach == "Row: is a type of a.py, b.py; a type's name means one thing"


def test_a_rust_type_has_one_name_in_the_whole_repository():
    assert list(script("check_layers").rust_name_breaches()) == []


def test_no_files_of_a_rust_folder_use_one_another_around():
    assert list(script("check_layers").rust_circles()) == []


def test_rust_files_that_use_one_another_around_are_found(tmp_path):
    (tmp_path / "noise").mkdir()
    (tmp_path / "noise" / "level.rs").write_text("use super::kind::Kind;\n")
    (tmp_path / "noise" / "kind.rs").write_text("use crate::noise::level::Level;\n")
    (tmp_path / "noise" / "fit.rs").write_text("use super::kind::Kind;\n#[cfg(test)]\nuse super::fit::Fit;\n")
    (circle,) = script("check_layers").rust_circles(tmp_path)
    room, _, around = circle.partition(": ")
    assert room == "noise"
    assert in_circle(around) == {"kind", "level"}


def test_a_rust_name_of_two_types_is_found_tests_and_c_aside(tmp_path):
    for crate, source in [
        ("tumble-core", "pub(crate) struct Row;\n#[cfg(test)]\nmod tests {\n    pub struct Row;\n}\n"),
        ("tumble-lab", "words! {\n    pub enum Row {}\n}\n"),
        ("tumble-capi", "pub struct Row;\n"),
    ]:
        (tmp_path / "crates" / crate / "src").mkdir(parents=True)
        (tmp_path / "crates" / crate / "src" / "lib.rs").write_text(source)
    (breach,) = script("check_layers").rust_name_breaches(tmp_path)
    homes = "crates/tumble-core/src/lib.rs, crates/tumble-lab/src/lib.rs"
    assert breach == f"Row: is a type of {homes}; a type's name means one thing"


@pytest.mark.parametrize(
    ("source", "breach"),
    [
        ("#![no_std]\nuse std::vec::Vec;", "lib.rs:2"),
        ("#![no_std]\nextern crate alloc;", "lib.rs:2"),
        ("#![no_std]\nfn f() { unsafe {} }", "lib.rs:2"),
        ("fn f() {}", "#![no_std] is missing"),
    ],
)
def test_a_device_crate_that_needs_more_than_core_is_found(tmp_path, monkeypatch, source, breach):
    module = script("check_layers")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    (tmp_path / "Cargo.toml").write_text('[workspace.lints.rust]\nunsafe_code = "forbid"\n')
    crate = tmp_path / "crates" / "tumble-core"
    (crate / "src").mkdir(parents=True)
    (crate / "Cargo.toml").write_text("[lints]\nworkspace = true\n")
    (crate / "src" / "lib.rs").write_text(source + "\n#[cfg(test)]\nmod tests { use std::vec::Vec; }\n")
    found = list(module.device_breaches(crate))
    assert len(found) == 1
    assert breach in found[0]


@pytest.mark.parametrize(
    ("declared", "breaches"),
    [
        ("#[cfg(test)]\nmod tests;", 0),
        ('#[cfg(test)]\n#[path = "tests.rs"]\nmod laws;', 0),
        ("mod tests;", 1),
        ('#[path = "tests.rs"]\nmod laws;', 1),
    ],
)
def test_test_files_may_use_the_system_if_compiled_for_tests_only(tmp_path, monkeypatch, declared, breaches):
    module = script("check_layers")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    (tmp_path / "Cargo.toml").write_text('[workspace.lints.rust]\nunsafe_code = "forbid"\n')
    crate = tmp_path / "crates" / "tumble-core"
    (crate / "src").mkdir(parents=True)
    (crate / "Cargo.toml").write_text("[lints]\nworkspace = true\n")
    (crate / "src" / "lib.rs").write_text(f"#![no_std]\n{declared}\n")
    (crate / "src" / "tests.rs").write_text("use std::vec::Vec;\n")
    assert len(list(module.device_breaches(crate))) == breaches


def test_a_page_is_read_as_a_person_types_it():
    module = script("check_commands")
    shell = "```sh\n$ make demo   # a minute\ntumble turntable a.csv \\\n    b.csv -o out\n```\n"
    text = f"# Tumble\n\n{shell}\n```python\nx = 1\n```\n"
    found = [(snippet.line, snippet.language, snippet.text) for snippet in module.snippets(text)]
    assert found == [
        (4, "sh", "make demo"),
        (5, "sh", "tumble turntable a.csv b.csv -o out"),
        (10, "python", "x = 1\n"),
    ]


@pytest.mark.parametrize("command", ["curl example.org | sh", "make castle", "pip install tumble-imu"])
def test_a_command_that_ci_does_not_prove_is_found(command):
    module = script("check_commands")
    assert module.problem(module.Snippet(1, "sh", command))


def test_a_command_of_a_page_that_fails_is_found(tmp_path):
    module = script("check_commands")
    assert "no such" in module.run(module.Snippet(1, "sh", "tumble inspect gone.csv"), tmp_path).wrong
    assert "ZeroDivisionError" in module.run(module.Snippet(1, "python", "1 / 0"), tmp_path).wrong
    assert module.run(module.Snippet(1, "python", "print(1)"), tmp_path) == module.Outcome(printed="1\n")


def test_pages_have_to_show_the_output_of_their_commands(tmp_path):
    module = script("check_commands")

    def wrong(shown):
        page = [module.Snippet(1, "python", "print('a  b\\nc\\nd')"), module.Snippet(4, "text", shown)]
        return [text for _, text in module.run_all(page, tmp_path, module.Simulations(tmp_path)) if text]

    assert wrong("a b\n...\nd\n") == []
    assert "`b`" in wrong("b\n")[0]
    assert "`a b`" in wrong("c\na b\n")[0]


def test_a_simulation_of_several_pages_is_made_once_and_copied(tmp_path, monkeypatch):
    module = script("check_commands")
    text, ran = sorted(module.repeated_simulations())[0], []

    def simulated(snippet, folder):
        ran.append(folder)
        (folder / text.split()[-1]).mkdir()
        (folder / text.split()[-1] / "log.csv").write_text("1")
        return module.Outcome(printed="made")

    monkeypatch.setattr(module, "run", simulated)
    simulations = module.Simulations(tmp_path / "kept")
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        assert simulations.run(module.Snippet(1, "sh", text), tmp_path / name).printed == "made"
        assert (tmp_path / name / text.split()[-1] / "log.csv").read_text() == "1"
    assert ran == [tmp_path / "one"]


@pytest.mark.parametrize("purpose", ["audit", "installer", "package", "run", "test"])
def test_requirements_name_versions_and_hashes_and_no_place(purpose):
    text = (ROOT / "requirements" / f"{purpose}.txt").read_text()
    assert not re.search(r"https?:|--index|--find-links|--extra|file:|^/|^-e", text, re.MULTILINE)
    pinned = re.findall(r"^[a-z0-9][^\n]*", text, re.MULTILINE)
    assert pinned
    assert all("==" in line for line in pinned)
    assert all(re.search(r"\n    --hash=sha256:[0-9a-f]{64}", entry) for entry in _entries(text))


def _entries(text):
    """Each pinned package with the hashes below it."""
    return re.findall(r"^[a-z0-9][^\n]*(?:\n    [^\n]*)*", text, re.MULTILINE)


def test_ci_runs_exactly_test_and_lint():
    lines = (ROOT / ".ci/run").read_text().splitlines()
    assert [line for line in lines if line.startswith("make")] == ["make test", "make lint"]


def test_workflows_pin_each_action_by_its_commit():
    """A tag or a branch can be moved to other code."""
    used = [
        line.strip()
        for path in sorted((ROOT / ".github" / "workflows").glob("*.yml"))
        for line in path.read_text().splitlines()
        if "uses:" in line and "uses: ./" not in line
    ]
    assert len(used) > 10
    assert [line for line in used if not re.search(r"@[0-9a-f]{40} # v\d+\.\d+\.\d+$", line)] == []


def test_the_image_pins_what_it_is_built_on_by_its_digest():
    used = [line for line in (ROOT / "Dockerfile").read_text().splitlines() if line.startswith("FROM ")]
    assert len(used) == 2
    pinned = r"FROM [a-z]+:\d+\.\d+\.\d+-[a-z-]+@sha256:[0-9a-f]{64}( AS [a-z]+)?"
    assert [line for line in used if not re.fullmatch(pinned, line)] == []


def test_no_test_is_skipped_for_want_of_a_library():
    """A skipped loader of a peer is how an export that the peer refused passed."""
    word = "import" + "orskip"
    skipping = [path for path in (ROOT / "tests").rglob("*.py") if word in path.read_text(encoding="utf-8")]
    assert skipping == []


def test_files_and_json_come_through_one_door(tmp_path):
    module = script("check_layers")
    for name, source in {
        "logs/csv.py": "import json\n\nPATH.exists()\njson.loads(PATH.read_text())\n",
        "foundation/file_status.py": "PATH.exists()\n",
        "foundation/bounded_json.py": "import json\n\njson.loads(TEXT)\n",
    }.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(source)
    assert [each.partition(";")[0] for each in module.door_breaches(tmp_path)] == [
        "logs/csv.py:3: calls exists",
        "logs/csv.py:4: calls json.loads",
        "logs/csv.py:4: calls read_text",
    ]
    assert list(module.door_breaches()) == []


@pytest.mark.parametrize(
    ("source", "breach"),
    [
        ('PATH.open("rb")', "calls open to read"),
        ('PATH.open(mode="r")', "calls open to read"),
        ('PATH.open(encoding="utf-8")', "calls open to read"),
        ("self.path.open()", "calls open to read"),
        ("open(PATH)", "calls open"),
        ('open(PATH, "rb")', "calls open"),
        ("os.open(PATH, os.O_RDONLY)", "calls os.open"),
        ("shutil.copyfile(PATH, OTHER)", "calls shutil.copyfile"),
        ("pa.OSFile(str(PATH))", "calls pa.OSFile"),
        ("sqlite3.connect(PATH)", "calls sqlite3.connect"),
        ('h5py.File(PATH, "r")', "gives h5py.File a name"),
        ("pq.ParquetFile(path)", "gives pq.ParquetFile a name"),
        ("zipfile.ZipFile(self.path)", "gives zipfile.ZipFile a name"),
        ('h5py.File(stream, "r")', ""),
        ('PATH.open("xb")', ""),
        ("store.open(stream)", ""),
        ("open_regular(PATH)", ""),
    ],
)
def test_only_one_door_opens_files_by_name(tmp_path, source, breach):
    module = script("check_layers")
    (tmp_path / "reader.py").write_text(f"{source}\n")
    found = [each.partition(";")[0] for each in module.door_breaches(tmp_path)]
    assert found == ([f"reader.py:1: {breach}"] if breach else [])

"""Released files: wheels that a newcomer can use, and files about them that agree with each other."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
import yaml

import tumble
from repetitions import only_soak
from tumble.logs.optional import EXTRAS

ROOT = Path(__file__).parents[2]
WORKFLOWS = ROOT / ".github" / "workflows"
PROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
VERSION = re.search(r'^version = "(.*)"$', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]


def script(name):
    """A script of the repository, as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def checked(schema, *paths):
    """Checks files against a schema that their makers publish."""
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema, *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode == 0, done.stdout + done.stderr


@only_soak("compiles again, and installs all libraries")
def test_an_installed_wheel_serves_a_newcomer_without_rust(tmp_path):
    for words in (("build_packages.py", tmp_path, "--as-built"), ("try_package.py", tmp_path)):
        command = [sys.executable, ROOT / "scripts" / words[0], *words[1:]]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.rstrip().endswith("works")


@pytest.fixture
def wheel(tmp_path):
    """A wheel made of the sources, as it should be."""
    path = tmp_path / "tumble.whl"
    about = "tumble_imu-0.1.0.dist-info/licenses"
    with zipfile.ZipFile(path, "w") as packed:
        for name in (*script("build_packages").sources(), f"{about}/LICENSE-MIT", f"{about}/LICENSE-APACHE"):
            packed.writestr(name, "")
        packed.writestr("tumble/_core.abi3.so", "")
    return path


def test_a_wheel_of_the_sources_has_no_fault(wheel):
    assert {"tumble/py.typed", "tumble/tools/demo/limits.yaml"} <= set(zipfile.ZipFile(wheel).namelist())
    assert list(script("build_packages").faults(wheel)) == []


def test_a_file_that_a_wheel_should_not_hold_is_a_fault(wheel):
    with zipfile.ZipFile(wheel, "a") as packed:
        packed.writestr("tumble/notes.txt", "")
    assert list(script("build_packages").faults(wheel)) == ["holds tumble/notes.txt"]


def test_a_file_that_a_wheel_lacks_is_a_fault(tmp_path):
    with zipfile.ZipFile(tmp_path / "empty.whl", "w"):
        pass
    found = list(script("build_packages").faults(tmp_path / "empty.whl"))
    assert {"0 native modules", "without LICENSE-MIT", "without tumble/py.typed"} <= set(found)


def test_no_compiler_of_rust_is_on_the_path_of_a_newcomer(tmp_path, monkeypatch):
    rust, other = tmp_path / "rust", tmp_path / "other"
    for program in (rust / "cargo", rust / "gcc", other / "gcc"):
        program.parent.mkdir(exist_ok=True)
        program.touch(mode=0o755)
    monkeypatch.setenv("PATH", os.pathsep.join([str(rust), str(other)]))
    first = tmp_path / "environment"
    assert script("try_package").path_without_rust(first) == os.pathsep.join([str(first), str(other)])


@pytest.mark.parametrize(
    ("file", "pattern"),
    [
        ("firmware/Cargo.toml", r'^version = "(.*)"$'),
        ("CITATION.cff", r"^version: (.*)$"),
        ("crates/tumble-capi/library.json", r'"version": "(.*)"'),
        ("crates/tumble-capi/include/tumble.h", r'#define TUMBLE_VERSION "(.*)"'),
        ("docs/how-to/results.md", r"software: tumble (.*)$"),
        ("docs/how-to/embed.md", r"tumble-(\d.*?)-c\b"),
    ],
)
def test_every_version_is_that_of_the_workspace(file, pattern):
    assert set(re.findall(pattern, (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)) == {VERSION}


def test_package_and_native_module_take_their_workspace_version():
    assert (
        "version" in re.search(r"^dynamic = \[(.*)\]", (ROOT / "pyproject.toml").read_text(), re.MULTILINE)[1]
    )
    assert tumble.__version__ == metadata.version("tumble-imu") == VERSION


def test_the_citation_is_valid():
    assert checked("vendor.citation-file-format", ROOT / "CITATION.cff")[0]


def test_the_workflows_are_valid(tmp_path):
    assert checked("vendor.github-workflows", *WORKFLOWS.glob("*.yml"))[0]
    wrong = tmp_path / "wrong.yml"
    wrong.write_text("on: push\njobs:\n  test:\n    runs-on: ubuntu-latest\n    stepz: []\n")
    assert "stepz" in checked("vendor.github-workflows", wrong)[1]


@pytest.mark.parametrize("path", sorted(WORKFLOWS.glob("*.yml")), ids=lambda path: path.stem)
def test_a_workflow_calls_what_there_is_and_ends_some_day(path):
    text = path.read_text(encoding="utf-8")
    for job in yaml.safe_load(text)["jobs"].values():
        assert "timeout-minutes" in job or job["uses"].startswith("./.github/workflows/")
    for named in re.findall(r"scripts/\w+\.(?:sh|py)|\./(?:\.github/workflows/\w+\.yml)", text):
        assert (ROOT / named).is_file(), named


def test_a_release_is_attested_and_published_without_a_password():
    text = (WORKFLOWS / "release.yml").read_text(encoding="utf-8")
    jobs = yaml.safe_load(text)["jobs"]
    assert [name for name, job in jobs.items() if job.get("permissions", {}).get("id-token")] == [
        "attest",
        "pypi",
    ]
    assert jobs["attest"]["permissions"]["attestations"] == "write"
    assert jobs["attest"]["needs"] == "packages"
    assert jobs["pypi"]["needs"] == "attest"
    assert "secrets." not in text


def test_image_runs_as_a_user_and_runs_the_tested_steps():
    stages = re.split(r"^FROM ", (ROOT / "Dockerfile").read_text(), flags=re.MULTILINE)[1:]
    assert re.findall(r"^USER (.*)$", stages[-1], re.MULTILINE) == ["tumble"]
    steps = re.findall(r"\S*image\.sh (\w+)", "".join(stages))
    tried = re.findall(r"/image\.sh\"? (\w+)", (ROOT / "scripts" / "build_image.sh").read_text())
    assert steps == tried == ["build", "install"]


def test_image_is_built_from_exactly_the_sources_of_the_wheel():
    lines = (ROOT / ".dockerignore").read_text().splitlines()
    allowed = {line.removeprefix("!") for line in lines if line.startswith("!")}
    assert "*" in lines
    assert all((ROOT / path).exists() for path in allowed)
    assert {"Cargo.toml", "Cargo.lock", "crates", "python", "pyproject.toml", "README.md"} <= allowed
    assert not {".git", "target", "tests", "out"} & allowed


def test_doctor_says_the_extras_that_there_are():
    (offered,) = re.findall(r"^all = \[\"tumble-imu\[(.*)\]\"\]$", PROJECT, re.MULTILINE)
    assert offered.split(",") == list(EXTRAS)

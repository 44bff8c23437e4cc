"""A folder as somebody works in: a registry, a project file, results, and a simulated session."""

from __future__ import annotations

from made_up_calibrations import made_up, save
from made_up_certificates import project_file
from tumble.laboratory.registry import Registry
from turntable_sessions import typed


def work_in(folder, monkeypatch):
    """Makes a folder a workplace, and the working folder of the test."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder / "nobody"))
    Registry.create(folder / "lab.db")
    (folder / "tumble.toml").write_text(project_file() + 'registry = "lab.db"\n')
    save(folder / "results", made_up(serial="1", log="1"))
    assert typed("simulate", "multipose", "-o", "session", "--seed", "1").code == 0

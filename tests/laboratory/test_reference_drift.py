"""Drift of a reference by the registry, where its certificate states none."""

import numpy as np
import pytest
import yaml

import certified_references as certified
from drifting_results import drifting
from tumble import Calibration, Registry
from tumble.laboratory.history import history_of
from tumble.laboratory.reference_drift import walks_of
from tumble.tools.simulate import write_turntable
from turntable_sessions import simulate, typed


@pytest.fixture
def registry(tmp_path):
    """Six units that were calibrated once a year, whose biases drift by 0.05 m/s^2."""
    made = Registry.create(tmp_path / "lab.db")
    made.add(drifting(tmp_path / "results"))
    return tmp_path / "lab.db"


def without_drift():
    content = certified.content()
    for triad in certified.U:
        del content[triad]["drift"]
    content["reference"] = {"model": "R-9", "serial": "0001"}
    return content


def test_walks_are_those_of_the_history(registry):
    found = walks_of(registry, "0001")
    history = history_of(Registry(registry), "0001")
    assert found == {each.measured.name: each.walk.q for each in history.parameters if each.walk is not None}
    assert any(name.startswith("accelerometer bias") for name in found)


def test_a_unit_that_the_registry_does_not_know_has_no_walk(registry):
    assert walks_of(registry, "elsewhere") == {}


def test_drift_grows_with_the_root_of_time():
    stated = certified.ReferenceCertificate.model_validate(without_drift())
    walks = {"accelerometer bias x": 4e-6}
    found = stated.influences("accelerometer", certified.day(), None, walks)[1]
    assert found.source.endswith("by the registry")
    years = 183 / 365.25
    assert np.sqrt(found.covariance[9, 9]) == pytest.approx(2e-3 * np.sqrt(years))
    assert found.covariance[10, 10] == 0.0


def test_the_command_takes_the_drift_of_its_registry(registry, tmp_path):
    session = simulate(3003, grades=("industrial",))
    write_turntable(session, tmp_path)
    log, serial = tmp_path / "reference.csv", session.reference.metadata.serial
    log.write_text(log.read_text().replace(serial, "0001", 1))
    (tmp_path / "reference.yaml").write_text(yaml.safe_dump(without_drift()))
    logs = log, tmp_path / "target_1.csv"
    done = typed(
        *("turntable", *logs, "--reference-certificate", tmp_path / "reference.yaml"),
        *("--registry", registry, "-o", tmp_path / "out"),
    )
    assert done.code == 0, done.err
    entries = Calibration.load(tmp_path / "out" / "target_1.yaml").accelerometer.budget[0].entries
    assert any(each.source.endswith("by the registry") for each in entries)

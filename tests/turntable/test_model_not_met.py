"""A model that does not explain the data, and noise that explains too much of it."""

import json
from dataclasses import replace

import numpy as np
from scipy.stats import chi2
from tests.support.turntable_sessions import calibrated, rows, simulate, write

import tumble
from tumble.calibration.document import Calibration
from tumble.foundation.recording import Chunk
from tumble.logs import open_writer
from tumble.procedures.turntable import target as module
from tumble.procedures.turntable.target import UNLIKELY

LIMITS = """
schema: tumble-limits/1
accelerometer:
  bias: 100.0
"""


def corrupted(folder, slip):
    """Logs of a session whose target turned to and fro in its fixture by some rad about all axes."""
    session = simulate(5100, rest_seconds=6.0, grades=("industrial",))
    reference, target = write(session, folder)
    samples = session.target_units[0].samples
    force = samples.accelerometer.copy()
    for first in range(len(force) // 6, len(force), len(force) // 3):
        part = slice(first, first + len(force) // 6)
        force[part] += np.cross(force[part], np.full(3, slip))
    with open_writer(target) as writer:
        writer.write(Chunk(samples.time, force, samples.gyroscope))
    return reference, target


def test_residuals_beyond_ten_times_the_noise_show_model_not_met(tmp_path):
    logs = corrupted(tmp_path, 0.01)
    out = tmp_path / "out"
    done = calibrated(*logs, "-o", out, code=3)
    assert "Model not met" in done.text
    assert rows(out)["target_1"]["verdict"] == "model not met"
    assert "times what the noise explains" in rows(out)["target_1"]["reason"]
    assert "Model not met" in (out / "target_1.html").read_text(encoding="utf-8")
    assert Calibration.load(out / "target_1.yaml").content()["accelerometer"]["widening"] > 10.0


def test_a_model_not_met_fails_limits_that_its_numbers_would_meet(tmp_path):
    logs = corrupted(tmp_path, 0.01)
    limits = tmp_path / "limits.yaml"
    limits.write_text(LIMITS)
    done = calibrated(*logs, "--limits", limits, "--json", "-o", tmp_path / "out", code=3)
    (target,) = json.loads(done.out)["targets"]
    assert target["verdict"] == "model not met"
    assert all(check["passed"] for check in target["checks"])


def test_a_session_as_the_model_has_it_is_calibrated(tmp_path):
    done = calibrated(*corrupted(tmp_path, 0.0), "-o", tmp_path / "out")
    assert "Model not met" not in done.text


def test_a_chi_square_far_too_small_is_remarked_like_one_too_large(monkeypatch):
    session = simulate(5200, grades=("industrial",))
    described = module.triad_result

    def shrunk(*arguments):
        found = described(*arguments)
        return replace(found, chi_square=0.5 * chi2.ppf(UNLIKELY, found.degrees_of_freedom))

    plain = tumble.turntable(session.reference, session.targets).targets[0]
    assert not any("smaller than the noise" in warning for warning in plain.warnings)
    monkeypatch.setattr(module, "triad_result", shrunk)
    found = tumble.turntable(session.reference, session.targets).targets[0]
    assert sum("smaller than the noise" in warning for warning in found.warnings) == 2

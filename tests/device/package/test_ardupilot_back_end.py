"""The back end for ArduPilot is one more IMU, whose readings are the output of a redundant set."""

from __future__ import annotations

import re

import pytest
import yaml

from package.packages import CRATE, HERE, ROOT, build, run

FOLDER = HERE / "ardupilot"


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """The back end with stand-ins of ArduPilot and a made flight."""
    folder = tmp_path_factory.mktemp("ardupilot")
    build(FOLDER, folder, EXAMPLE=ROOT / "examples" / "ardupilot", TUMBLE_SOURCE=CRATE, TUMBLE_UNITS="3")
    return folder / "flight"


def test_calibrated_secondary_flies_on_when_ardupilots_primary_dies(flight):
    said = run(flight, "3")
    assert said.count("MAV_SEVERITY_INFO Tumble: IMU2 calibrated") == 2
    assert "MAV_SEVERITY_WARNING Tumble: IMU1 unhealthy" in said
    outputs, _, errors = said.splitlines()[-1].removeprefix("outputs ").partition(", error ")
    while_calibrating, before, after = map(int, outputs.split())
    # 400 Hz: a second in which ArduPilot calibrates, until the primary dies, and from a second later.
    assert while_calibrating == 400
    assert before == pytest.approx(56 * 400, abs=2)
    assert after == pytest.approx(2 * 400, abs=2)
    numbers = [abs(float(word)) for word in errors.split()]
    # The secondary has errors of 0.1 to 0.3 m/s^2 and 0.02 to 0.05 rad/s before it is calibrated.
    assert max(numbers[0::2]) < 0.005
    assert max(numbers[1::2]) < 0.0005


def test_another_number_of_imus_is_reported_and_gives_no_output(flight):
    said = run(flight, "2")
    assert "MAV_SEVERITY_CRITICAL Tumble: 2 gyros and 2 accels instead of 3" in said
    assert "outputs 0 0 0," in said


def squeezed(text):
    """Text of C++ without what its layout may change."""
    return re.sub(r"\s*([^\w\s])\s*", r"\1", re.sub(r"\s+", " ", text))


def test_declarations_of_the_stand_ins_are_those_of_ardupilot():
    stand_ins = (FOLDER / "stand_ins.hpp").read_text()
    for name, declarations in yaml.safe_load((FOLDER / "declarations.yaml").read_text()).items():
        (body,) = re.findall(
            rf"^(?:class|namespace) {name}\n{{\n(.*?)^}}", stand_ins, re.MULTILINE | re.DOTALL
        )
        missing = [each for each in declarations if squeezed(each) not in squeezed(body)]
        assert not missing, name

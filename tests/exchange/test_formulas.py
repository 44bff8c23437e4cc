"""Files for other programs, read by the formulas of those programs, correct as Tumble does."""

import json
import re

import numpy as np
import pytest
import yaml

from exchange_units import calibration, samples
from tumble.exchange.procedure import export

FORMATS_OF_KALIBR = {"rate": "200"}


def text_of(unit, to, **settings):
    exported = export(unit, to, {name.replace("_", "-"): str(value) for name, value in settings.items()})
    return exported.content.decode(), exported


def parameters(text, separator, name, value):
    lines = [re.split(separator, line) for line in text.splitlines() if not line.startswith("#")]
    return {fields[name]: float(fields[value]) for fields in lines}


def vector(found, names):
    return np.array([found[names.format(axis)] for axis in "XYZ"])


def close(found, expected, tolerance):
    assert np.abs(found - expected).max() < tolerance


@pytest.mark.parametrize("seed", range(5))
def test_px4_corrects_by_its_parameters_as_tumble_does(seed):
    unit = calibration(seed, parts=("scale",))
    unit = unit.model_copy(update={"gyroscope": unit.gyroscope.model_copy(update={"M": np.eye(3)})})
    text, exported = text_of(unit, "px4", accelerometer_id=2490378, gyroscope_id="0x2600", instance=1)
    assert exported.losses == ()
    found = parameters(text, "\t", 2, 3)
    assert (found["CAL_ACC1_ID"], found["CAL_GYRO1_ID"]) == (2490378, 0x2600)
    force, rate = samples(seed)
    true_force, true_rate = unit.correct(force, rate)
    # sensor_calibration/Accelerometer.hpp: (data - thermal_offset - offset).emult(scale)
    close((force - vector(found, "CAL_ACC1_{}OFF")) * vector(found, "CAL_ACC1_{}SCALE"), true_force, 1e-5)
    close(rate - vector(found, "CAL_GYRO1_{}OFF"), true_rate, 1e-6)
    assert "CAL_GYRO1_XSCALE" not in found


@pytest.mark.parametrize("temperature", [-30.0, 5.0, 30.0, 80.0])
def test_px4_subtracts_what_temperature_does_once(temperature):
    unit = calibration(11, parts=("scale",), over_temperature=True)
    text, _ = text_of(unit, "px4", accelerometer_id=1, gyroscope_id=2)
    found = parameters(text, "\t", 2, 3)
    force, rate = samples(1)
    true_force, _ = unit.correct(force, rate, temperature)
    # temperature_compensation.cpp: the temperature is held within TMIN and TMAX
    held = min(max(temperature, found["TC_A0_TMIN"]), found["TC_A0_TMAX"]) - found["TC_A0_TREF"]
    thermal = sum(
        np.array([found[f"TC_A0_X{power}_{axis}"] for axis in range(3)]) * held**power for power in range(4)
    )
    offset, scale = vector(found, "CAL_ACC0_{}OFF"), vector(found, "CAL_ACC0_{}SCALE")
    assert found["TC_A_ENABLE"] == found["TC_G_ENABLE"] == 1.0
    close((force - thermal - offset) * scale, true_force, 1e-5)


@pytest.mark.parametrize("temperature", [-30.0, 5.0, 30.0, 80.0])
def test_ardupilot_corrects_by_its_parameters_as_tumble_does_at_any_temperature(temperature):
    unit = calibration(3, parts=("scale",), over_temperature=True)
    text, _ = text_of(unit, "ardupilot", instance=2)
    found = parameters(text, ",", 0, 1)
    force, rate = samples(3)
    true_force, _ = unit.correct(force, rate, temperature)

    def held(degrees):
        return min(max(degrees, found["INS_TCAL2_TMIN"]), found["INS_TCAL2_TMAX"]) - 35.0

    def polynomial(degrees):
        # AP_InertialSensor_tempcal.cpp: coefficients times 1e-6 about 35 degC
        powers = (vector(found, f"INS_TCAL2_ACC{k}_" + "{}") * held(degrees) ** k for k in (1, 2, 3))
        return 1e-6 * sum(powers)

    thermal = polynomial(temperature) - polynomial(found["INS_ACC2_CALTEMP"])
    offset, scale = vector(found, "INS_ACC2OFFS_{}"), vector(found, "INS_ACC2SCAL_{}")
    close((force - thermal - offset) * scale, true_force, 2e-5)
    assert found["INS_GYR_CAL"] == 0.0


def frame_of(matrix):
    """Rotation of the frame in which the matrix of an accelerometer is lower triangular."""
    turned, upper = np.linalg.qr(matrix.T)
    return (turned * np.sign(np.diag(upper))).T


@pytest.mark.parametrize("seed", range(5))
def test_kalibr_and_openvins_model_what_tumble_corrects(seed):
    unit = calibration(seed)
    text, _ = text_of(unit, "kalibr", **FORMATS_OF_KALIBR)
    imu = yaml.safe_load(text)["imu0"]
    matrix, turned, response = (np.array(imu["gyroscopes"][key]) for key in ("M", "C_gyro_i", "A"))
    lower = np.array(imu["accelerometers"]["M"])
    assert np.allclose(np.triu(lower, 1), 0.0)
    assert np.allclose(np.triu(matrix, 1), 0.0)
    force, rate = samples(seed)
    # Rehder et al. 2016: a_m = M a, w_m = M C w + A C a, in the frame of the accelerometer
    read_force = force @ lower.T + unit.accelerometer.b
    read_rate = rate @ (matrix @ turned).T + force @ (response @ turned).T + unit.gyroscope.b
    frame = frame_of(unit.accelerometer.M)
    found_force, found_rate = unit.correct(read_force, read_rate)
    close(found_force @ frame.T, force, 1e-12)
    close(found_rate @ frame.T, rate, 1e-12)

    chain = yaml.safe_load(text_of(unit, "openvins", **FORMATS_OF_KALIBR)[0].partition("\n")[2])["imu0"]
    tw, ta, tg, gyro = (np.array(chain[key]) for key in ("Tw", "Ta", "Tg", "R_IMUtoGYRO"))
    assert np.array_equal(chain["R_IMUtoACC"], np.eye(3))
    # VioManagerOptions.h: D = T^-1, w = R_GYROtoIMU Dw (w_m - b_g - Tg a)
    their_force = (read_force - unit.accelerometer.b) @ np.linalg.inv(ta).T
    corrected = read_rate - unit.gyroscope.b - their_force @ tg.T
    close(their_force, force, 1e-12)
    close(corrected @ np.linalg.inv(tw).T @ gyro, rate, 1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_imu_tk_corrects_by_its_files_as_tumble_does_in_the_frame_of_the_accelerometer(seed):
    unit = calibration(seed, parts=("non-orthogonality", "mounting", "scale"))
    read = dict(zip(("accelerometer", "gyroscope"), samples(seed), strict=True))
    corrected = dict(zip(read, unit.correct(*read.values()), strict=True))
    turned, upper = np.linalg.qr(np.linalg.inv(unit.accelerometer.M))
    frame = (turned * np.sign(np.diag(upper))).T
    for triad, values in read.items():
        numbers = np.array(text_of(unit, f"imu-tk-{triad}")[0].split(), dtype=float)
        misalignment, scale, bias = numbers[:9].reshape(3, 3), numbers[9:18].reshape(3, 3), numbers[18:]
        assert np.allclose(np.diag(misalignment), 1.0)
        if triad == "accelerometer":
            assert np.allclose(np.tril(misalignment, -1), 0.0)
        close((values - bias) @ (misalignment @ scale).T, corrected[triad] @ frame.T, 1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_imucal_corrects_by_its_file_as_tumble_does(seed):
    unit = calibration(seed)
    text, exported = text_of(unit, "imucal")
    stated = {key: np.array(value) for key, value in json.loads(text).items() if len(key) in (3, 4)}
    force, rate = samples(seed)
    # FerrarisCalibrationInfo: a = R_a^-1 K_a^-1 (y - b_a), w = R_g^-1 K_g^-1 (y - K_ga a - b_g), in deg/s
    their_force = (force - stated["b_a"]) @ np.linalg.inv(stated["K_a"] @ stated["R_a"]).T
    free = np.degrees(rate) - their_force @ stated["K_ga"].T - stated["b_g"]
    their_rate = np.radians(free @ np.linalg.inv(stated["K_g"] @ stated["R_g"]).T)
    true_force, true_rate = unit.correct(force, rate)
    close(their_force, true_force, 1e-11)
    close(their_rate, true_rate, 1e-11)
    assert exported.losses == ()


def constants(text):
    found = re.findall(r"(\w+) = \{\.array = \{(.*)\}\};", text)
    return {name: np.array([float(word.rstrip("f")) for word in values.split(",")]) for name, values in found}


@pytest.mark.parametrize("seed", range(3))
def test_fusion_corrects_by_its_constants_as_tumble_does(seed):
    unit = calibration(seed, parts=("non-orthogonality", "mounting", "scale"))
    found = constants(text_of(unit, "fusion")[0])
    read = dict(zip(("accelerometer", "gyroscope"), samples(seed), strict=True))
    corrected = dict(zip(read, unit.correct(*read.values()), strict=True))
    for triad, unit_of_si in (("accelerometer", 1.0 / 9.80665), ("gyroscope", np.degrees(1.0))):
        # FusionCalibrationInertial: misalignment * ((uncalibrated - offset) .* sensitivity)
        scaled = (read[triad] - found[f"{triad}Offset"]) * found[f"{triad}Sensitivity"]
        theirs = scaled @ found[f"{triad}Misalignment"].reshape(3, 3).T
        close(theirs, unit_of_si * corrected[triad], 1e-5 * max(1.0, unit_of_si))


def test_ros2_parameters_correct_as_tumble_does():
    unit = calibration(2)
    text, exported = text_of(unit, "ros2")
    found = {key: np.array(value) for key, value in yaml.safe_load(text)["/**"]["ros__parameters"].items()}
    force, rate = samples(2)
    their_force = (force - found["accelerometer_bias"]) @ found["accelerometer_correction"].reshape(3, 3).T
    free = rate - found["gyroscope_bias"] - their_force @ found["gyroscope_g_sensitivity"].reshape(3, 3).T
    true_force, true_rate = unit.correct(force, rate)
    close(their_force, true_force, 1e-12)
    close(free @ found["gyroscope_correction"].reshape(3, 3).T, true_rate, 1e-12)
    assert exported.losses == ()


def test_autoware_subtracts_the_bias_of_the_gyroscope():
    unit = calibration(2, parts=())
    text, exported = text_of(unit, "autoware", rate=100)
    found = yaml.safe_load(text)["/**"]["ros__parameters"]
    offset = np.array([found[f"angular_velocity_offset_{axis}"] for axis in "xyz"])
    _, rate = samples(2)
    close(rate - offset, unit.correct(None, rate)[1], 1e-10)
    assert found["acceleration_stddev"] == pytest.approx(2e-3 * 10.0)
    assert [(loss.triad, loss.part) for loss in exported.losses] == [("accelerometer", "bias")]


def test_betaflight_subtracts_whole_counts_and_says_what_rounding_leaves():
    unit = calibration(2, parts=())
    text, exported = text_of(unit, "betaflight", counts_per_g=2048)
    counts = np.array(re.search(r"set acc_calibration = (.*),1", text).group(1).split(","), dtype=float)
    force, _ = samples(2)
    (rounding,) = (loss.size for loss in exported.losses if loss.triad == "accelerometer")
    theirs = (force * 2048 / 9.80665 - counts) * 9.80665 / 2048
    assert np.abs(theirs - unit.correct(force)[0]).max() == pytest.approx(rounding, abs=1e-12)


def test_programs_that_see_are_told_noise_in_their_own_terms():
    unit = calibration(2)
    kalibr = yaml.safe_load(text_of(unit, "kalibr-noise", rate=400)[0])
    assert kalibr["accelerometer_noise_density"] == pytest.approx(2e-3)
    assert kalibr["gyroscope_random_walk"] == pytest.approx(1e-4)
    # VINS adds its figures once a sample, ORB-SLAM3 multiplies by the root of the rate itself.
    vins = yaml.safe_load(text_of(unit, "vins", rate=400)[0])
    assert (vins["acc_n"], vins["gyr_w"]) == (pytest.approx(2e-3 * 20.0), pytest.approx(1e-4 * 20.0))
    orb = yaml.safe_load(text_of(unit, "orb-slam3", rate=400)[0])
    assert (orb["IMU.NoiseAcc"], orb["IMU.Frequency"]) == (pytest.approx(2e-3), 400.0)

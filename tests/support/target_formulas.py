"""Exported files, read and applied as each target does it: by its own loader, or by its stated formula.

`corrected(word, path, force, rate)` gives (n, 3) of either triad in m/s^2 and rad/s, None for a triad that
the target leaves alone. Where the formula stands: tests/exchange/conformance.yaml.
"""

import json
import re
import subprocess

import cv2
import imucal
import imufusion
import numpy as np
import yaml
from pymavlink.mavparm import MAVParmDict

from arduino_chip import CHIPS
from tumble import _core
from tumble.foundation.units import TRIADS

G = 9.80665
INCLUDE = "crates/tumble-capi/include"


def corrected(word, path, force, rate):
    return FORMULAS[word](path, force, rate)


def names_in(word, path):
    """All names that a file gives values to."""
    return READERS[word](path)


def parameters(path):
    """Lines of QGroundControl: vehicle, component, name, value, type."""
    lines = [line.split("\t") for line in path.read_text().splitlines() if not line.startswith("#")]
    return {name: float(value) for _, _, name, value, _ in lines}


def by_mavparm(path):
    found = MAVParmDict()
    assert found.load(str(path))
    return dict(found)


def axes(found, names):
    return np.array([found[names.format(axis)] for axis in "XYZ"])


def of_px4(path, force, rate):
    found = parameters(path)
    offset = {word: axes(found, f"CAL_{word}0_{{}}OFF") for word in ("ACC", "GYRO")}
    return (force - offset["ACC"]) * axes(found, "CAL_ACC0_{}SCALE"), rate - offset["GYRO"]


def of_ardupilot(path, force, rate):
    found = by_mavparm(path)
    shifted = force - axes(found, "INS_ACCOFFS_{}")
    return shifted * axes(found, "INS_ACCSCAL_{}"), rate - axes(found, "INS_GYROFFS_{}")


def of_betaflight(path, force, rate):
    numbers = re.search(r"^set acc_calibration = (.*)$", path.read_text(), re.MULTILINE).group(1)
    *offset, calibrated = map(int, numbers.split(","))
    assert calibrated == 1
    return (force * 2048 / G - offset) * G / 2048, None


def flat(content, before=""):
    found = {}
    for key, value in content.items():
        found |= flat(value, f"{before}{key}.") if isinstance(value, dict) else {before + key: value}
    return found


def by_pyyaml(path):
    return flat(yaml.safe_load(path.read_text()))


def of_kalibr(path, force, rate):
    found = {name: np.array(value) for name, value in by_pyyaml(path).items()}
    turned = found["imu0.gyroscopes.C_gyro_i"]
    forward, response = (found[f"imu0.gyroscopes.{key}"] @ turned for key in "MA")
    true_force = force @ np.linalg.inv(found["imu0.accelerometers.M"]).T
    return true_force, (rate - true_force @ response.T) @ np.linalg.inv(forward).T


def by_opencv(path):
    """Names and numbers of a FileStorage, which is read to its end."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert storage.isOpened()

    def node_at(node, before):
        if node.isMap():
            names = ((name, node.getNode(name)) for name in node.keys())  # noqa: SIM118 - no mapping
            return {key: v for name, each in names for key, v in node_at(each, f"{before}{name}.").items()}
        return {before[:-1]: value_of(node)}

    def value_of(node):
        if node.isSeq():
            return [value_of(node.at(k)) for k in range(node.size())]
        return node.string() if node.isString() else node.real()

    return node_at(storage.root(), "")


def of_openvins(path, force, rate):
    found = {name: np.array(value) for name, value in by_opencv(path).items()}
    assert found["imu0.model"] == "kalibr"
    # The model "kalibr" keeps the lower triangle of the inverse of a matrix.
    dw, da = (np.tril(np.linalg.inv(found[f"imu0.{key}"])) for key in ("Tw", "Ta"))
    true_force = force @ da.T @ found["imu0.R_IMUtoACC"]
    free = rate - true_force @ found["imu0.Tg"].T
    return true_force, free @ dw.T @ found["imu0.R_IMUtoGYRO"]


def in_sequence(path):
    """Numbers in the order of operator >>: nine, nine and three, and no word after them (calibration.h)."""
    numbers = np.array(path.read_text().split()[:21], dtype=np.float64)
    assert len(numbers) == 21
    return {
        "misalignment": numbers[:9].reshape(3, 3),
        "scale": numbers[9:18].reshape(3, 3),
        "bias": numbers[18:],
    }


def by_imu_tk(path, readings):
    found = in_sequence(path)
    assert np.allclose(np.diag(found["misalignment"]), 1.0)
    return (readings - found["bias"]) @ (found["misalignment"] @ found["scale"]).T


def of_imucal(path, force, rate):
    info = imucal.CalibrationInfo.from_json_file(path)
    true_force, degrees = info.calibrate(force, np.degrees(rate), acc_unit="m/s^2", gyr_unit="deg/s")
    return true_force, np.radians(degrees)


def of_node(path):
    (parameters_,) = yaml.safe_load(path.read_text())["/**"].values()
    return flat(parameters_)


def of_autoware(path, force, rate):
    found = of_node(path)
    assert found["on_off_correction.correct_for_static_bias"] is True
    return None, rate - [found[f"angular_velocity_offset_{axis}"] for axis in "xyz"]


def of_ros2(path, force, rate):
    found = {name: np.array(value) for name, value in of_node(path).items()}
    inverse = {
        triad: found[f"{triad}_correction"].reshape(3, 3).T for triad in ("accelerometer", "gyroscope")
    }
    true_force = (force - found["accelerometer_bias"]) @ inverse["accelerometer"]
    free = rate - found["gyroscope_bias"] - true_force @ found["gyroscope_g_sensitivity"].reshape(3, 3).T
    return true_force, free @ inverse["gyroscope"]


def printed_by_c(path, head, statements, include="."):
    """Compiles a program with an exported file in it, and returns what it prints."""
    program = path.with_suffix(".test.c")
    body = "\n    ".join(statements)
    main = f"int main(void) {{\n    {body}\n    return 0;\n}}\n"
    program.write_text(f'#include <stdio.h>\n{head}\n#include "{path.name}"\n{main}')
    binary = path.with_suffix(".test")
    strict = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-const-variable")
    subprocess.run(
        ["cc", *strict, f"-I{path.parent}", f"-I{include}", program, "-o", binary],
        check=True, capture_output=True,
    )  # fmt: skip
    return subprocess.run([binary], check=True, capture_output=True, text=True).stdout.split()


FUSION_TYPES = """\
typedef union { float array[3]; struct { float x, y, z; } axis; } FusionVector;
typedef union { float array[9]; struct { float xx, xy, xz, yx, yy, yz, zx, zy, zz; } element; } FusionMatrix;
"""
"""With the members of Fusion/FusionMath.h."""
FUSION_SIZES = {"Misalignment": 9, "Sensitivity": 3, "Offset": 3}


def of_fusion(path, force, rate):
    names = {
        f"{triad}{part}": n for triad in ("accelerometer", "gyroscope") for part, n in FUSION_SIZES.items()
    }
    statements = [
        f'for (int k = 0; k < {size}; k++) printf("%.9g\\n", (double){name}.array[k]);'
        for name, size in names.items()
    ]
    numbers = np.array(printed_by_c(path, FUSION_TYPES, statements), dtype=np.float64)
    ends = np.cumsum(list(names.values()))[:-1]
    found = dict(zip(names, np.split(numbers, ends), strict=True))
    results = []
    for triad, readings, to_si in (("accelerometer", force, G), ("gyroscope", rate, np.radians(1.0))):
        misalignment, sensitivity, offset = (found[f"{triad}{part}"] for part in FUSION_SIZES)
        modelled = [
            imufusion.model_inertial(each, misalignment.reshape(3, 3), sensitivity, offset)
            for each in readings
        ]
        results.append(np.array(modelled) * to_si)
    return tuple(results)


def of_c(path, force, rate):
    statements = [
        f"values = (const float *)calibration.{triad}.{part}; "
        f'for (int k = 0; k < {size}; k++) printf("%.9g\\n", (double)values[k]);'
        for triad in TRIADS
        for part, size in (("matrix", 9), ("bias", 3))
    ]
    printed = printed_by_c(path, "", ["const float *values;", *statements], INCLUDE)
    numbers = np.array(printed, dtype=np.float64)
    parts = np.split(numbers, [9, 12, 21])
    return tuple(
        (readings - bias) @ np.linalg.inv(matrix.reshape(3, 3)).T
        for readings, matrix, bias in ((force, parts[0], parts[1]), (rate, parts[2], parts[3]))
    )


def records_in(word, path):
    """Records by sensor, taken apart by the core, as tumble_record_decode() does on a device."""
    if word == "record-c":
        arrays = re.findall(r"uint8_t (\w+)\[(\d+)\]", path.read_text())
        statements = [f'for (int k = 0; k < {size}; k++) printf("%02x", {name}[k]);' for name, size in arrays]
        content = bytes.fromhex("".join(printed_by_c(path, "", statements)))
    else:
        content = bytes.fromhex(path.read_text()) if word == "record-hex" else path.read_bytes()
    found = {}
    while content:
        record, content = np.split(np.frombuffer(content, np.uint8), [_core.record_length(content)])
        stated = _core.decode_record(record.tobytes())
        found[stated["sensor"] + ("_drift" if "temperature_drift" in stated else "")] = stated
        content = content.tobytes()
    return found


def by_records(word):
    def apply(path, force, rate):
        found = records_in(word, path)
        readings = {"accelerometer": force, "gyroscope": rate}
        return tuple(
            (readings[triad] - found[triad]["bias"]) @ np.linalg.inv(found[triad]["matrix"]).T
            for triad in readings
        )

    return apply


def noise_of_sample(word, path, rate):
    """Sigma of a sample and of the step of the bias between two, a row for each triad, in SI units."""
    per_sample = np.sqrt(rate)
    if word == "vins":
        found = by_opencv(path)
        white, walk = ([found[f"{triad}_{kind}"] for triad in ("acc", "gyr")] for kind in "nw")
        return np.array([white, np.array(walk) / rate]).T
    if word == "orb-slam3":
        found = by_opencv(path)
        assert found["IMU.Frequency"] == rate
        white, walk = (
            [found[f"IMU.{name}"] for name in names]
            for names in (("NoiseAcc", "NoiseGyro"), ("AccWalk", "GyroWalk"))
        )
        return np.array([np.array(white) * per_sample, np.array(walk) / per_sample]).T
    found = by_pyyaml(path)
    if word == "lio-sam":
        # GTSAM's covariance over the time between samples.
        white, walk = (
            [found[f"imu{triad}{kind}"] for triad in ("Acc", "Gyr")] for kind in ("Noise", "BiasN")
        )
        return np.array([np.array(white) * per_sample, np.array(walk) / per_sample]).T
    if word == "fast-lio":
        # P += dt^2 Q
        white, walk = (
            [found[f"mapping.{kind}{triad}_cov"] for triad in ("acc", "gyr")] for kind in ("", "b_")
        )
        return np.sqrt([white, np.array(walk) / rate**2]).T
    assert found["update_rate"] == rate
    white, walk = (
        np.array([found[f"{triad}_{kind}"] for triad in ("accelerometer", "gyroscope")])
        for kind in ("noise_density", "random_walk")
    )
    return np.array([white / np.sqrt(1.0 / rate), walk / per_sample]).T


FORMULAS = {
    "px4": of_px4,
    "ardupilot": of_ardupilot,
    "betaflight": of_betaflight,
    "kalibr": of_kalibr,
    "openvins": of_openvins,
    "imu-tk-accelerometer": lambda path, force, rate: (by_imu_tk(path, force), None),
    "imu-tk-gyroscope": lambda path, force, rate: (None, by_imu_tk(path, rate)),
    "imucal": of_imucal,
    "autoware": of_autoware,
    "ros2": of_ros2,
    "fusion": of_fusion,
    "c": of_c,
    **CHIPS,
    **{word: by_records(word) for word in ("record", "record-hex", "record-c")},
}
NOISE = ("kalibr-noise", "vins", "orb-slam3", "lio-sam", "fast-lio")
COVARIANCES = ("robot-localization",)


def constants_of_c(path):
    return re.findall(r"^static const (\w+ \w+) = ", path.read_text(), re.MULTILINE)


def registers_of(path):
    """Registers that a sketch writes, and those that it adds to."""
    calls = re.findall(r"tumble_(put|add)\(wire, chip, (0x\w\w),", path.read_text())
    return list(dict.fromkeys(place + (" addend" if call == "add" else "") for call, place in calls))


READERS = {
    "px4": parameters,
    "ardupilot": by_mavparm,
    "betaflight": lambda path: re.findall(r"^set (\w+) =", path.read_text(), re.MULTILINE),
    "kalibr": by_pyyaml,
    "kalibr-noise": by_pyyaml,
    "openvins": by_opencv,
    "vins": by_opencv,
    "orb-slam3": by_opencv,
    **dict.fromkeys(("lio-sam", "fast-lio", "robot-localization"), by_pyyaml),
    "imu-tk-accelerometer": in_sequence,
    "imu-tk-gyroscope": in_sequence,
    "imucal": lambda path: json.loads(path.read_text()),
    "autoware": of_node,
    "ros2": of_node,
    "fusion": constants_of_c,
    "c": constants_of_c,
    **dict.fromkeys(CHIPS, registers_of),
    **{word: lambda path, word=word: records_in(word, path) for word in ("record", "record-hex", "record-c")},
}

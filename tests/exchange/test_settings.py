"""Settings that a target or a compiler would refuse are refused before, in one line."""

import re
import subprocess

import numpy as np
import pytest
import yaml

from exchange_units import calibration, needed
from target_formulas import INCLUDE, parameters, printed_by_c
from tumble.foundation.errors import ProcedureError
from tumble.tools.exchange.procedure import export

IDS = {"accelerometer-id": "1310988", "gyroscope-id": "2490378"}
PX4_ID = "give a whole number from 1 to 2147483647"
KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile
    while _Bool _Complex _Generic bool true false nullptr constexpr typeof class namespace template this new
    delete and or not operator wchar_t uint8_t int32_t size_t INT8_MAX UINT32_C NULL SIZE_MAX main linux unix
    tumble_calibration tumble_error_model TUMBLE_VERSION __func__ _Static_assert a__b
""".split()  # noqa: SIM905 - as standards list them


@pytest.mark.parametrize("number", ["0", "-1", "2147483648", "4294967295", "1e3", "0x1_0000_0000_0", ""])
def test_an_id_that_is_no_positive_int32_is_refused_for_px4(number):
    for name in IDS:
        with pytest.raises(ProcedureError, match=f"{re.escape(name)}=.*give a whole number") as raised:
            export(calibration(1), "px4", IDS | {name: number})
        assert "\n" not in str(raised.value)


def test_the_largest_id_of_px4_is_written_whole(tmp_path):
    path = tmp_path / "vehicle.params"
    path.write_bytes(export(calibration(1), "px4", IDS | {"gyroscope-id": "0x7fffffff"}).content)
    assert parameters(path)["CAL_GYRO0_ID"] == 2**31 - 1


@pytest.mark.parametrize("instance", ["-1", "4", "99"])
def test_px4_has_four_slots_and_no_more(instance):
    with pytest.raises(ProcedureError, match="PX4 numbers IMUs 0 to 3"):
        export(calibration(1), "px4", IDS | {"instance": instance})
    with pytest.raises(ProcedureError, match="PX4 numbers IMUs 0 to 3"):
        export([calibration(1), calibration(2)], "px4", IDS | {"instance": "3"})


@pytest.mark.parametrize("word", ["c", "record-c"])
@pytest.mark.parametrize("name", KEYWORDS)
def test_a_name_that_compilers_or_headers_have_is_refused(word, name):
    with pytest.raises(ProcedureError, match=f"--set name={name}: .*give another"):
        export(calibration(1), word, needed(word) | {"name": name})


@pytest.mark.parametrize("standard", ["c99", "gnu17", "c++20"])
def test_names_that_are_taken_compile(tmp_path, standard):
    header = tmp_path / "all.h"
    names = ["integer", "int_", "Main", "tumbl", "t", "_lower", "calibration2", "imu_time"]
    texts = [export(calibration(1), "c", {"name": name}).content.decode() for name in names]
    header.write_text("".join(texts))
    program = tmp_path / ("all.cpp" if "+" in standard else "all.c")
    program.write_text('#include "all.h"\nint main(void) { return 0; }\n')
    compiler = "c++" if "+" in standard else "cc"
    strict = [f"-std={standard}", "-Wall", "-Wextra", "-Werror", "-Wno-unused-const-variable"]
    strict += ["-Wno-unused-variable", f"-I{INCLUDE}", "-fsyntax-only"]
    done = subprocess.run([compiler, *strict, program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_records_as_arrays_of_c_compile(tmp_path):
    path = tmp_path / "records.h"
    path.write_bytes(export(calibration(1), "record-c", {"identity": "7", "name": "factory"}).content)
    assert printed_by_c(path, "", ['printf("%d", factory_gyroscope[0]);']) == [str(ord("T"))]


@pytest.mark.parametrize("word", ["kalibr", "kalibr-noise", "openvins"])
@pytest.mark.parametrize("topic", ["/imu: 3", "imu #1", "a\nb: c", '"/imu"', "", "7imu"])
def test_a_topic_that_yaml_would_take_apart_is_refused(word, topic):
    with pytest.raises(ProcedureError, match=r"give a name of a topic|needs --set topic"):
        export(calibration(1), word, needed(word) | {"topic": topic})


@pytest.mark.parametrize("rate", ["1e-7", "1e7", "1000000", "200", "99.75"])
def test_a_rate_is_a_number_to_yaml_1_1(rate):
    text = export(calibration(1), "kalibr-noise", {"rate": rate}).content.decode()
    assert yaml.safe_load(text)["update_rate"] == float(rate)


def test_a_gyroscope_turned_by_90_deg_is_refused_for_imu_tk():
    unit = calibration(1, parts=())
    turned = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    unit = unit.model_copy(update={"gyroscope": unit.gyroscope.model_copy(update={"M": turned})})
    with pytest.raises(ProcedureError, match="is turned by 90 deg against the accelerometer"):
        export(unit, "imu-tk-gyroscope")

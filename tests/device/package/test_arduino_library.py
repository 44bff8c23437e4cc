"""The library for Arduino has the layout of its specification, and its sketch finds the biases of a chip."""

from __future__ import annotations

import re
import sys
import zipfile

import pytest

from arduino_chip import ARDUINO_H, WIRE_H
from package.packages import CARGO_FOLDER, CRATE, ROOT, build, run

LIBRARY = CRATE / "arduino"
SKETCH = LIBRARY / "examples" / "Spin" / "Spin.ino"

# From the specification of Arduino's library format, revision 2.2.
REQUIRED = {
    "name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url", "architectures",
}  # fmt: skip
OPTIONAL = {"depends", "dot_a_linkage", "includes", "precompiled", "ldflags"}
CATEGORIES = {
    "Display", "Communication", "Signal Input/Output", "Sensors", "Device Control", "Timing", "Data Storage",
    "Data Processing", "Other",
}  # fmt: skip

BOARD = "thumbv7em-none-eabihf"
COMPILER = ("arm-none-eabi-g++", "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
STRICT = ("-std=gnu++11", "-Wall", "-Wextra", "-Werror", "-DCHIP=0x68", "-DRESETS=0")

SERIAL = """
#include <stdio.h>
uint32_t micros();
class Printed {
  public:
    void begin(unsigned long) {}
    void print(const char *text) { fputs(text, stdout); }
    void print(double value, int digits) { printf("%.*f", digits, value); }
    void println(const char *text = "") { puts(text); }
};
static Printed Serial;
"""
"""Calls of Arduino that a sketch which prints has beside those of a bus."""

MAIN = """
#include "Arduino.h"
#include "Wire.h"
#include "Spin.ino"
extern "C" {
#include "robot.h"
}

static tumble_sample sample;
uint32_t micros() { return (uint32_t)sample.time; }

static void put(int place, float value) {
    const int16_t word = (int16_t)lroundf(value);
    registers[place] = (uint8_t)(word >> 8);
    registers[place + 1] = (uint8_t)word;
}

int main() {
    setup();
    for (int k = 0; k < 6000; k++) {
        sample = robot_read();
        for (int axis = 0; axis < 3; axis++) {
            put(0x3B + 2 * axis, sample.specific_force[axis] / FORCE);
            put(0x43 + 2 * axis, sample.angular_rate[axis] / RATE);
        }
        loop();
        robot_turn(k > 1000 && !calibrated ? 1.0f : 0.0f);
    }
    return Wire.unknown;
}
"""


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """A folder with the sketch as Arduino compiles it, and a robot that carries the chip."""
    folder = tmp_path_factory.mktemp("sketch")
    (folder / "Arduino.h").write_text(ARDUINO_H + SERIAL)
    (folder / "Wire.h").write_text(WIRE_H)
    (folder / "main.cpp").write_text("#include <math.h>\n" + MAIN)
    return folder


def compiled(compiler, sources, *libraries):
    """Path of the program that a compiler makes of the sketch."""
    robot = ROOT / "examples" / "c"
    includes = [f"-I{path}" for path in (sources, CRATE / "include", SKETCH.parent, robot)]
    run("cc" if compiler[0] == "c++" else "arm-none-eabi-gcc", *compiler[1:], "-std=c99", *includes, "-c",
        robot / "robot.c", "-o", sources / "robot.o")  # fmt: skip
    run(*compiler, *STRICT, *includes, sources / "main.cpp", sources / "robot.o", *libraries, "-lm",
        "-o", sources / "program")  # fmt: skip
    return sources / "program"


def test_sketch_finds_the_biases_of_a_chip_on_a_robot(sources, tmp_path):
    build(CRATE, tmp_path)
    said = run(compiled(("c++",), sources, tmp_path / "libtumble.a"))
    found = {
        name: [float(word) for word in words.split()]
        for name, words in re.findall(r"^(\w+ bias) (.*)$", said, re.MULTILINE)
    }
    # Biases of the robot of the example in C; a count is 0.0006 m/s^2 and 0.0003 rad/s.
    assert found["accelerometer bias"] == pytest.approx([0.15, -0.08, 0.2], abs=0.006)
    assert found["gyroscope bias"] == pytest.approx([0.01, -0.02, 0.005], abs=0.001)
    assert re.findall(r"^rate (.*)$", said, re.MULTILINE)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The folder that the IDE unpacks, for one processor."""
    folder = tmp_path_factory.mktemp("arduino")
    options = ("--target", BOARD, "--cargo-folder", CARGO_FOLDER)
    packed = run(sys.executable, ROOT / "scripts" / "package_arduino.py", folder, *options)
    with zipfile.ZipFile(packed.strip()) as archive:
        archive.extractall(folder)
    return folder / "Tumble"


def test_sketch_links_with_the_packed_library_for_a_cortex_m4f(library, sources):
    archive = library / "src" / "cortex-m4" / "fpv4-sp-d16-hard" / "libtumble.a"
    program = compiled(
        (*COMPILER, "--specs=nosys.specs", "-Wl,--gc-sections", "-Wl,--no-warnings"), sources, archive
    )
    assert "ARM" in run("arm-none-eabi-readelf", "-h", program)


def properties(path):
    return dict(line.split("=", 1) for line in path.read_text().splitlines())


def test_properties_of_the_library_are_those_that_arduino_asks_for(library):
    found = properties(library / "library.properties")
    assert set(found) >= REQUIRED
    assert set(found) <= REQUIRED | OPTIONAL
    assert found["category"] in CATEGORIES
    assert f'\nversion = "{found["version"]}"\n' in (ROOT / "Cargo.toml").read_text()
    assert all((library / "src" / name).is_file() for name in found["includes"].split(","))
    assert (found["precompiled"], found["ldflags"]) == ("true", "-ltumble")
    assert all(path.stem == path.parent.name for path in library.glob("examples/*/*.ino"))


def test_highlighted_words_are_names_of_the_header(library):
    header = (library / "src" / "tumble.h").read_text()
    for line in (library / "keywords.txt").read_text().splitlines():
        word, kind = line.split("\t")
        assert kind in {"KEYWORD1", "KEYWORD2", "LITERAL1"}
        assert re.search(rf"\b{word}\b", header), word

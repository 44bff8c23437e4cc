"""A sketch's file on a bus with one chip, whose offsets are then applied as its maker states.

Arduino.h and Wire.h here declare what Arduino's Wire library documents, and no more.
"""

import subprocess

import numpy as np

G = 9.80665
DEGREE = np.pi / 180.0
TRIMS = [-1235, 3110, 777]
"""Words of the factory, some with bit 0 set."""
ARDUINO_H = """\
#pragma once
#include <stdint.h>
static inline void delay(unsigned long) {}
"""
WIRE_H = """\
#pragma once
#include <stdint.h>
#include <string.h>

static uint8_t registers[256], power_on[256];

class TwoWire {
    uint8_t place = 0;
    bool placed = false;

  public:
    int unknown = 0;
    void begin() {}
    void beginTransmission(uint8_t chip) { unknown += chip != CHIP; placed = false; }
    uint8_t endTransmission(bool = true) { return 0; }
    uint8_t requestFrom(uint8_t chip, uint8_t) { unknown += chip != CHIP; return 1; }
    int read() { return registers[place++]; }
    size_t write(uint8_t value) {
        if (!placed) {
            place = value;
            placed = true;
        } else if (RESETS && place == 0x6B && (value & 0x80)) {
            memcpy(registers, power_on, sizeof registers);
        } else {
            registers[place++] = value;
        }
        return 1;
    }
};
static TwoWire Wire;
"""
MAIN = """\
#include <stdio.h>
#include "{file}"
int main() {{
    uint8_t expected[256];
    (void)expected;
    const int words[] = {{{words}}}, places[] = {{{places}}};
    for (int k = 0; k < 256; k++) power_on[k] = RESETS ? 0 : (uint8_t)(k * 7);
    for (int k = 0; k < {count}; k++) {{
        power_on[places[k]] = (uint8_t)(words[k] >> 8);
        power_on[places[k] + 1] = (uint8_t)words[k];
    }}
    memcpy(registers, power_on, sizeof registers);
    // The sketch starts twice while the chip keeps its power.
    tumble_write_offsets(Wire);
    tumble_write_offsets(Wire);
#if RESETS
    // And after a library that has reset the chip.
    memcpy(expected, registers, sizeof registers);
    memcpy(registers, power_on, sizeof registers);
    tumble_write_offsets(Wire, CHIP, false);
    if (memcmp(expected, registers, sizeof registers)) return 2;
#endif
    for (int k = 0; k < 256; k++) printf("%d ", registers[k]);
    return Wire.unknown;
}}
"""


def after(path, address, trimmed=()):
    """The 256 registers of a chip at this address after the sketch has started twice."""
    folder = path.with_suffix(".sketch")
    folder.mkdir(exist_ok=True)
    (folder / "Arduino.h").write_text(ARDUINO_H)
    (folder / "Wire.h").write_text(WIRE_H)
    words, places = (", ".join(map(str, each)) for each in (TRIMS, trimmed or [0]))
    text = MAIN.format(file=path.resolve(), words=words, places=places, count=len(trimmed))
    (folder / "main.cpp").write_text(text)
    strict = ("-std=c++11", "-Wall", "-Wextra", "-Werror")
    chip = (f"-DCHIP={address}", f"-DRESETS={int(bool(trimmed))}")
    compiled = ["c++", *strict, *chip, f"-I{folder}", folder / "main.cpp", "-o", folder / "main"]
    subprocess.run(compiled, check=True, capture_output=True)
    done = subprocess.run([folder / "main"], check=True, capture_output=True, text=True)
    return list(map(int, done.stdout.split()))


def word(found, place):
    return int.from_bytes(bytes(found[place : place + 2]), "big", signed=True)


def of_mpu(places):
    """The application note: offsets are added; those of the accelerometer to the trim, in 2048 per g."""

    def apply(path, force, rate):
        found = after(path, 0x68, places)
        words = np.array([word(found, place) for place in places])
        assert (words & 1).tolist() == (np.array(TRIMS) & 1).tolist()
        assert found[0x6B] == 0
        turned = [word(found, place) for place in (0x13, 0x15, 0x17)]
        return force + (words - TRIMS) * G / 2048.0, rate + np.array(turned) * DEGREE / 32.8

    return apply


def bosch_rates(found):
    upper = [found[0x77] >> 2 * k & 0x3 for k in range(3)]
    ten = np.array([high << 8 | found[0x74 + k] for k, high in enumerate(upper)])
    return np.where(ten > 511, ten - 1024, ten) * 2000.0 * DEGREE / 2**15


def signed(found, first):
    return np.array(found[first : first + 3], dtype=np.uint8).view(np.int8).astype(float)


def of_bmi160(path, force, rate):
    """bmi160_set_offsets(): both are added where bits 6 and 7 of 0x77 are set."""
    found = after(path, 0x68)
    assert found[0x77] & 0xC0 == 0xC0
    return force + signed(found, 0x71) * G / 256.0, rate + bosch_rates(found)


def of_bmi270(path, force, rate):
    """bmi2.c: both are added where bit 3 of 0x70 and bit 6 of 0x77 are set; bit 7 is about gain."""
    found = after(path, 0x68)
    assert found[0x70] == 0x70 * 7 & 0xFF | 0x08
    assert found[0x77] & 0xC0 == 0x77 * 7 & 0x80 | 0x40
    return force + signed(found, 0x71) * G / 256.0, rate + bosch_rates(found)


def of_lsm6dso(path, force, rate):
    """lsm6dso_reg.h: subtracted, 2^-10 g a step, where bit 3 of CTRL6_C is clear and bit 1 of CTRL7_G set."""
    found = after(path, 0x6A)
    assert found[0x15] == 0x15 * 7 & 0xFF & ~0x08
    assert found[0x16] == 0x16 * 7 & 0xFF | 0x02
    return force - signed(found, 0x73) * G / 1024.0, None


CHIPS = {
    "registers-mpu6050": of_mpu((0x06, 0x08, 0x0A)),
    "registers-mpu9250": of_mpu((0x77, 0x7A, 0x7D)),
    "registers-bmi160": of_bmi160,
    "registers-bmi270": of_bmi270,
    "registers-lsm6dso": of_lsm6dso,
}

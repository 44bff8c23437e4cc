"""Register writes as a C++ file for a sketch of Arduino, on a bus of its Wire library."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Put:
    """Bits of a register, the others left as they are."""

    register: int
    bits: int
    mask: int = 0xFF
    wait_ms: int = 0
    """Pause after it, ms."""

    def line(self) -> str:
        """Returns the statement that writes it."""
        wait = f" delay({self.wait_ms});" if self.wait_ms else ""
        return f"tumble_put(wire, chip, 0x{self.register:02X}, 0x{self.bits:02X}, 0x{self.mask:02X});{wait}"


@dataclass(frozen=True, slots=True)
class Add:
    """Even addend to a word, high byte first; its last bit stays."""

    register: int
    addend: int

    def line(self) -> str:
        """Returns the statement that writes it."""
        return f"tumble_add(wire, chip, 0x{self.register:02X}, {self.addend});"


Operation: TypeAlias = Put | Add

_PUT = """\
static uint8_t tumble_get(TwoWire &wire, uint8_t chip, uint8_t place) {
    wire.beginTransmission(chip);
    wire.write(place);
    wire.endTransmission(false);
    wire.requestFrom(chip, (uint8_t)1);
    return (uint8_t)wire.read();
}

static void tumble_put(TwoWire &wire, uint8_t chip, uint8_t place, uint8_t bits, uint8_t mask) {
    const uint8_t kept = mask == 0xFF ? 0 : (uint8_t)(tumble_get(wire, chip, place) & ~mask);
    wire.beginTransmission(chip);
    wire.write(place);
    wire.write((uint8_t)(kept | bits));
    wire.endTransmission();
}
"""
_ADD = """
static void tumble_add(TwoWire &wire, uint8_t chip, uint8_t place, int16_t addend) {
    const uint8_t high = tumble_get(wire, chip, place), low = tumble_get(wire, chip, (uint8_t)(place + 1));
    const uint16_t sum = (uint16_t)((((uint16_t)high << 8) | low) + (uint16_t)addend);
    tumble_put(wire, chip, place, (uint8_t)(sum >> 8), 0xFF);
    tumble_put(wire, chip, (uint8_t)(place + 1), (uint8_t)sum, 0xFF);
}
"""
_CALL = "// In setup(), after the chip is configured: tumble_write_offsets(Wire);"
_CALL_WITH_RESET = """\
// In setup(), after Wire.begin() and before the chip is configured: tumble_write_offsets(Wire);
// It resets the chip; after a library that has reset and configured it, give false as the last argument."""


def sketch(title: str, address: int, operations: Sequence[Operation], reset: Sequence[Operation]) -> str:
    """Returns the file of a function that resets a chip, if it has to, and writes its registers.

    `address` is that of the chip on the bus, by default.
    """
    helpers = _PUT + (_ADD if any(isinstance(each, Add) for each in operations) else "")
    body = "".join(f"    {each.line()}\n" for each in operations)
    call, more = _CALL, ""
    if reset:
        call, more = _CALL_WITH_RESET, ", bool reset = true"
        lines = "".join(f"        {each.line()}\n" for each in reset)
        body = f"    if (reset) {{\n{lines}    }}\n{body}"
    return f"""\
// {title}.
{call}
#pragma once
#include <Arduino.h>
#include <Wire.h>

{helpers}
static void tumble_write_offsets(TwoWire &wire, uint8_t chip = 0x{address:02X}{more}) {{
{body}}}
"""

"""Flash, memory and instructions of each part on a Cortex-M4F, as QEMU emulates one.

`python -m benchmarks.footprint [--symbols IMAGE] [--no-save]`
"""

from __future__ import annotations

import argparse
import re
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import mean, median

from rich.console import Console
from rich.table import Table

from benchmarks.results import Content, save
from benchmarks.stack_bound import StackBounds, functions

ROOT = Path(__file__).parent.parent
TARGET = "thumbv7em-none-eabihf"
PLATFORM = ROOT / "target" / "firmware" / TARGET / "platform"
IMAGES = ROOT / "target" / TARGET / "device"
BASELINE = "empty"
PARTS = ("apply", "temperature", "spin", "redundancy", "store", "everything")
FLASH_GOALS = {"spin": 26 * 1024, "redundancy": 62 * 1024, "store": 10 * 1024, "everything": 92 * 1024}
MEMORY_GOALS = {"Monitor": 5120, "MonitorOfTwo": 3584}
STACK_GOALS = {"SpinPush": 4096, "SpinSlice": 4096, "Fit": 4096}
INSTRUCTION_GOALS = {"Apply": 150, "Push": 3000, "PushDense": 1800}
"""On average."""
LARGEST_GOAL = 100_000
"""Goal for any one sample: 0.6 ms at 168 MHz."""
SAMPLE_PHASES = ("SpinPush", "SpinSlice", "Push", "PushDense", "Fit", "FitDense")
WHOLE_GOALS = {"SpinSlice": 1_200_000, "FitDense": 1_200_000}
"""Goals for all slices together."""
SHIFT = 4
"""QEMU lets 2^4 ns pass with each instruction, 0.4 counts of the timer: so a fit does not outlast it."""
CHECK = "check"
CHECKED_TIMES = 10_000
CHECKED = 2 * (2 * CHECKED_TIMES + 1)
"""Instructions of the loop that the image counts to check the timer (`delay` of the crate cortex-m)."""
AROUND = 40
"""Most instructions of the call of that loop and of reading the timer."""
STACK = r"^device: stack (?:at least )?(\d+) bytes: (\w+)(?:, by the function at (0x[0-9a-f]+))?"
"""Report of the platform on its whole stack, regardless of which function took it."""
BY_REGISTER = (
    # Listeners of events.
    (r"\{\{closure\}\}|vtable.shim", r"^mission::flight::.*take::\{\{closure\}\}"),
    (r"^<?tumble_core::redundancy::fit::", r"joint_moments::.*PairMoments<T>>::"),
    (
        r"^tumble_core::redundancy::|^platform::",
        r"joint_moments::.*PairMoments<T>>::|\{\{closure\}\}|vtable.shim",
    ),
)
"""Patterns of the names of functions that call by a register, and of the functions that they may so call."""
FEW = 2
"""Phases that occur no more often than this are listed one by one."""


def build(*images: str) -> None:
    """Builds these images, or all, and the platform."""
    subprocess.run(("scripts/build_firmware.sh",), check=True, cwd=ROOT)
    options = ("--quiet", "--locked", "--profile", "device", "--manifest-path", "firmware/Cargo.toml")
    folder = ("--target-dir", str(ROOT / "target"))
    command = ("scripts/cargo_for_device.sh", "build", *options, *folder, "--package", "footprint")
    wanted = (word for image in images for word in ("--bin", image))
    subprocess.run((*command, *wanted), check=True, cwd=ROOT)


def flash(image: str) -> int:
    """Bytes of code, constants and initial values of an image."""
    said = _said("arm-none-eabi-size", str(IMAGES / image)).splitlines()[1].split()
    return int(said[0]) + int(said[1])


def symbols(image: str) -> list[tuple[int, str]]:
    """Bytes and names of what lies in the flash of an image, largest first."""
    lines = _said("arm-none-eabi-nm", "--print-size", "--demangle", str(IMAGES / image)).splitlines()
    parted = [line.split(maxsplit=3) for line in lines]
    held = [fields for fields in parted if len(fields) == 4 and fields[2] in "tTrRdDwWvV"]
    return sorted(((int(size, 16), name) for _, size, _, name in held), reverse=True)


def count() -> Content:
    """Runs the mission and counts instructions, by phase."""
    return understood(_emulated(IMAGES / "instructions", "-icount", f"shift={SHIFT}"))


def memory() -> tuple[Content, Content, Content]:
    """Flies the platform; bytes of its states, and of stack by what was done: of this flight, and of any."""
    states, stack, functions_ = remembered(_emulated(PLATFORM))
    # The lowest bit marks Thumb code.
    bounds = StackBounds(functions(PLATFORM), BY_REGISTER)
    return states, stack, {name: bounds.of(at & ~1).bytes for name, at in functions_.items()}


def remembered(said: str) -> tuple[Content, Content, dict[str, int]]:
    """Bytes of states and of stack out of the output of the platform, and addresses of functions.

    A function is named by what it did when it took most: one takes samples, also those that solve a spin.
    """
    states = {name: int(size) for size, name in re.findall(r"^device: state (\d+) bytes: (\w+)$", said, re.M)}
    stack: Content = {}
    largest: dict[str, str] = {}
    for size, name, at in re.findall(STACK, said, re.M):
        stack[name] = max(stack.get(name, 0), int(size))
        if at and stack[name] > stack[largest.setdefault(at, name)]:
            largest[at] = name
    return states, stack, {name: int(at, 0) for at, name in largest.items()}


def understood(said: str) -> Content:
    """Instructions out of the output of the image.

    Raises `ValueError` where its check of the timer is not what its loop takes, or something took longer than
    the timer counts.
    """
    counted: dict[str, list[float]] = {}
    for line in said.splitlines():
        name, times, number = line.split()
        if not number.isdecimal():
            raise ValueError(f"{name} took longer than the timer counts")
        counted.setdefault(name, []).append(int(number) / 2**SHIFT / int(times))
    check = counted.pop(CHECK)[0] * CHECKED_TIMES
    if not CHECKED <= check <= CHECKED + AROUND:
        raise ValueError(f"the timer counted {check:.0f} instructions where there are {CHECKED}")
    return {name: _statistics(each) for name, each in counted.items()}


def _statistics(each: list[float]) -> Content:
    """Sums, mean, middle and largest."""
    return {
        "times": len(each),
        "each": each if len(each) <= FEW else None,
        "sum": sum(each),
        "mean": mean(each),
        "median": median(each),
        "largest": max(each),
    }


def measure() -> Content:
    """Measures all images, which are built."""
    empty = flash(BASELINE)
    states, stack, bounds = memory()
    return {
        "flash_bytes": {part: flash(part) - empty for part in PARTS},
        "empty_bytes": empty,
        "instructions": count(),
        "bytes": states,
        "stack_bytes": stack,
        "stack_bound_bytes": bounds,
    }


def table(content: Content) -> Table:
    """Figures as a table on screen, beside the goals."""
    shown = Table("", "", "goal", title="Cortex-M4F")
    for cells in rows(content):
        shown.add_row(*cells)
    return shown


FLASH_NAMES = {
    "apply": "applying a calibration",
    "temperature": "the same at a temperature",
    "spin": "spin",
    "redundancy": "redundancy, two secondaries",
    "store": "records in flash, emulated flash included",
    "everything": "all together",
}
STATE_NAMES = {
    "Corrections": "calibration of both triads",
    "SpinMachine": "spin",
    "Monitor": "redundancy, two secondaries",
    "MonitorOfTwo": "redundancy, one secondary",
    "Watch": "redundancy that only watches, two secondaries",
    "WatchOfTwo": "redundancy that only watches, one secondary",
    "Platform": "its units and settings",
    "RecordStore": "records in flash",
}
STACK_NAMES = {
    "SpinPush": "a sample of a spin",
    "SpinSlice": "a sample with which a spin is solved on",
    "SpinSolve": "solving a spin at once, with a true angle",
    "Push": "a sample of a redundant set",
    "Fit": "a sample with which a calibration is fitted on",
    "Restore": "restoring records after a start",
    "Save": "saving a record",
}
INSTRUCTION_NAMES = {
    "Apply": "applying a calibration to both triads",
    "SpinPush": "a sample of a spin",
    "SpinSlice": "a sample with which a spin is solved on",
    "Push": "a sample of a redundant set, 40 a second",
    "PushDense": "a sample of a redundant set, 200 a second",
    "Fit": "a sample with which a calibration is fitted on",
    "Restore": "restoring records after a start, with none and with four",
    "Save": "saving a record",
    "SaveIntoAFullBank": "saving a record into a full bank",
}


MEMORY_NAMES = {
    "Monitor": "all that exist at one time, with two secondaries",
    "MonitorOfTwo": "all that exist at one time, with one secondary",
}


def at_one_time(states: Content, monitor: str = "Monitor") -> int:
    """Bytes of states that exist at one time: spin takes the place of a set, whose settings are constant."""
    return int(max(states[monitor], states["SpinMachine"]) + states["RecordStore"] + states["Corrections"])


def largest(instructions: Content) -> float:
    """Most instructions of any one sample."""
    return max(float(instructions[phase]["largest"]) for phase in SAMPLE_PHASES)


def rows(content: Content) -> Iterator[tuple[str, str, str]]:
    """Names, size and goal of each row, as text."""
    states, instructions = content["bytes"], content["instructions"]
    for part, name in FLASH_NAMES.items():
        allowed = FLASH_GOALS.get(part)
        goal = f"{allowed // 1024} KiB" if allowed else ""
        yield f"flash: {name}", f"{content['flash_bytes'][part] / 1024:.1f} KiB", goal
    for state, name in STATE_NAMES.items():
        yield f"state: {name}", f"{states[state]} bytes", ""
    for monitor, name in MEMORY_NAMES.items():
        goal = _number(MEMORY_GOALS[monitor], " bytes")
        yield f"state: {name}", f"{at_one_time(states, monitor)} bytes", goal
    for phase, name in STACK_NAMES.items():
        yield f"stack: {name}", _stack_words(content, phase), _number(STACK_GOALS.get(phase), " bytes")
    for phase, name in INSTRUCTION_NAMES.items():
        goal = _number(INSTRUCTION_GOALS.get(phase))
        yield f"instructions: {name}", _words(instructions[phase]), goal
    for phase, allowed in WHOLE_GOALS.items():
        whole = f"{whole_instructions(instructions, phase):,.0f}"
        yield f"instructions: {WHOLE_NAMES[phase]}", whole, _number(allowed)
    yield "instructions: most of any one sample", f"{largest(instructions):,.0f}", _number(LARGEST_GOAL)


WHOLE_NAMES = {"SpinSlice": "solving a whole spin", "FitDense": "fitting both sensors of a secondary"}


def whole_instructions(instructions: Content, phase: str) -> float:
    """Instructions of all samples that advance the spin solution, or the calibration of the dense flight."""
    return float(instructions[phase]["sum"])


def _number(number: int | None, unit: str = "") -> str:
    return f"{number:,}{unit}" if number else ""


def _stack_words(content: Content, phase: str) -> str:
    painted = f"{content['stack_bytes'][phase]} bytes"
    # Figures kept from before there were bounds have none.
    bound = content.get("stack_bound_bytes", {}).get(phase)
    return f"{painted}, {bound} at most" if bound else painted


def _words(of: Content) -> str:
    if of["each"]:
        return ", ".join(f"{one:,.0f}" for one in of["each"])
    return f"{of['mean']:,.0f}; median {of['median']:,.0f}, largest {of['largest']:,.0f}"


def _emulated(image: Path, *options: str) -> str:
    return _said("scripts/run_in_qemu.sh", str(image), *options)


def _said(*command: str) -> str:
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT).stdout


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--symbols", choices=(BASELINE, *PARTS), help="list what is largest in an image")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    build()
    if options.symbols:
        for size, name in symbols(options.symbols)[:40]:
            console.print(f"{size:6} {name}", markup=False, highlight=False, no_wrap=True)
        return
    content = measure()
    console.print(table(content))
    if not options.no_save:
        console.print(f"written to {save('footprint', content)}")


if __name__ == "__main__":
    main()

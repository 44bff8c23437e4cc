"""Flash, memory and instructions of each part on a Cortex-M4F, as QEMU emulates one.

`python -m benchmarks.footprint [--symbols IMAGE] [--no-save]`
"""

from __future__ import annotations

import argparse
import subprocess
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.results import Content, save

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "target" / "firmware"
IMAGES = FOLDER / "thumbv7em-none-eabihf" / "release"
BASELINE = "empty"
PARTS = ("apply", "spin", "redundancy", "store", "everything")
FLASH_GOAL = 32 * 1024
MEMORY_GOAL = 4 * 1024
INSTRUCTION_GOALS = {"Apply": 150, "SpinPush": 1500, "Push": 3000}
SHIFT = 7
"""QEMU lets 2^7 ns pass with each instruction, 3.2 counts of the timer: so every single one is told apart."""
CHECK = "check"
CHECKED = 2 * 20_001
"""Instructions of the loop that the image counts to check the timer (`delay` of the crate cortex-m)."""
AROUND = 40
"""Most instructions of the call of that loop and of reading the timer."""
BOARD = ("-M", "mps2-an386", "-cpu", "cortex-m4", "-nographic", "-monitor", "none", "-serial", "none")
LONGEST_RUN = 120.0


def build() -> None:
    """Build all images."""
    options = ("--quiet", "--locked", "--release", "--manifest-path", "firmware/Cargo.toml")
    folder = ("--target-dir", str(FOLDER))
    command = ("scripts/cargo_for_cortex_m.sh", "build", *options, *folder, "--package", "footprint")
    subprocess.run(command, check=True, cwd=ROOT)


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


def count() -> tuple[Content, Content]:
    """Run the mission and count; instructions by what was done, bytes by state."""
    clock = ("-icount", f"shift={SHIFT}", "-semihosting-config", "enable=on,target=native")
    said = _said("qemu-system-arm", *BOARD, *clock, "-kernel", str(IMAGES / "instructions"))
    return understood(said)


def understood(said: str) -> tuple[Content, Content]:
    """Instructions and bytes out of what the image said.

    Raises `ValueError` where its check of the timer is not what its loop takes.
    """
    instructions: Content = {}
    sizes: Content = {}
    for line in said.splitlines():
        name, *numbers = line.split()
        if name == "bytes":
            sizes[numbers[0]] = int(numbers[1])
        elif len(numbers) == 3:
            times, together, largest = map(int, numbers)
            # The image takes an instruction for a nanosecond.
            mean = together / 2**SHIFT / times if times else 0.0
            instructions[name] = {"times": times, "mean": mean, "largest": round(largest / 2**SHIFT)}
    checked = instructions.pop(CHECK)
    counted = checked["mean"] * checked["times"]
    if not CHECKED <= counted <= CHECKED + AROUND:
        raise ValueError(f"the timer counted {counted:.0f} instructions where there are {CHECKED}")
    return instructions, sizes


def measure() -> Content:
    """Measure all images, which are built."""
    empty = flash(BASELINE)
    instructions, sizes = count()
    return {
        "flash_bytes": {part: flash(part) - empty for part in PARTS},
        "empty_bytes": empty,
        "instructions": instructions,
        "bytes": sizes,
        "goals": {"flash_bytes": FLASH_GOAL, "bytes": MEMORY_GOAL, "instructions": INSTRUCTION_GOALS},
    }


def table(content: Content) -> Table:
    """Figures as a table on screen, beside the goals."""
    shown = Table("", "mean or all", "largest", "goal", title="Cortex-M4F")
    for part, size in content["flash_bytes"].items():
        goal = FLASH_GOAL if part == "everything" else None
        shown.add_row(f"flash of {part}, bytes", _marked(size, goal), "", _number(goal))
    for name, size in content["bytes"].items():
        shown.add_row(f"memory of {name}, bytes", str(size), "", "")
    together = sum(content["bytes"].values())
    shown.add_row("memory of all, bytes", _marked(together, MEMORY_GOAL), "", str(MEMORY_GOAL))
    for name, of in content["instructions"].items():
        goal = INSTRUCTION_GOALS.get(name)
        # What is timed in one go, over and over, has no largest.
        largest = _marked(of["largest"], goal) if of["largest"] else ""
        shown.add_row(f"instructions of {name}", _marked(of["mean"], goal), largest, _number(goal))
    return shown


def _marked(value: float, goal: int | None) -> str:
    return f"[bold red]{value:.0f}[/]" if goal is not None and value > goal else f"{value:.0f}"


def _number(goal: int | None) -> str:
    return "" if goal is None else str(goal)


def _said(*command: str) -> str:
    run = subprocess.run(
        command,
        check=True,
        stdout=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
        cwd=ROOT,
        timeout=LONGEST_RUN,
    )
    return run.stdout


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark from the command line."""
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

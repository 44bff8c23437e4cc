"""Print the share of branches of the isolation that tests of Rust reach, and those that none reaches.

A branch counts as reached if any test reaches it, in single or double precision, for any number of units.
It needs a nightly Rust with the component llvm-tools, since a stable one has no coverage of branches.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
JUDGE = ROOT / "crates" / "tumble-core" / "src" / "redundancy" / "isolation"
TOOLCHAIN = "+" + os.environ.get("TUMBLE_NIGHTLY", "nightly")
BUILT = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "coverage"
TESTS = ("test", "--locked", "--package", "tumble-core", "--package", "tumble-lab", "--tests")

Branch = tuple[str, int, int, bool]
"""File, line, column, and the outcome of the condition there."""


def output(*command: str | Path) -> str:
    """Output of a command, whose messages are shown."""
    environment = {
        **os.environ,
        "CARGO_TARGET_DIR": str(BUILT),
        "RUSTFLAGS": "-Cinstrument-coverage -Zcoverage-options=branch",
        "LLVM_PROFILE_FILE": str(BUILT / "profiles" / "%m.profraw"),
    }
    words = [str(word) for word in command]
    return subprocess.run(
        words, cwd=ROOT, check=True, env=environment, stdout=subprocess.PIPE, text=True
    ).stdout


def tools() -> Path:
    """Folder of llvm-cov and llvm-profdata."""
    found = list(
        Path(output("rustc", TOOLCHAIN, "--print", "sysroot").strip()).glob("lib/rustlib/*/bin/llvm-cov")
    )
    if not found:
        sys.exit(f"no llvm-cov: rustup toolchain install {TOOLCHAIN[1:]} --component llvm-tools")
    return found[0].parent


def programs() -> list[str]:
    """Paths of the programs that cargo has built of the tests."""
    told = output("cargo", TOOLCHAIN, *TESTS, "--no-run", "--message-format", "json").splitlines()
    built = (json.loads(line).get("executable") for line in told if line.startswith("{"))
    return [path for path in built if path]


def tests_begin(file: str) -> int:
    """Line from which a file holds tests, which are no part of the judge."""
    lines = Path(file).read_text().splitlines()
    return lines.index("#[cfg(test)]") if "#[cfg(test)]" in lines and "mod tests {" in lines else len(lines)


def measured(folder: Path) -> Counter[Branch]:
    """Times that each branch was taken, in all programs."""
    merged = BUILT / "merged.profdata"
    output(
        folder / "llvm-profdata",
        "merge",
        "--sparse",
        *(BUILT / "profiles").glob("*.profraw"),
        "--output",
        merged,
    )
    first, *others = programs()
    objects = [word for other in others for word in ("--object", other)]
    told = output(
        folder / "llvm-cov", "export", first, *objects, "--instr-profile", merged, "--sources", JUDGE
    )
    taken: Counter[Branch] = Counter()
    for function in json.loads(told)["data"][0]["functions"]:
        for line, column, _, _, true, false, file, *_ in function["branches"]:
            name = function["filenames"][file]
            if Path(name).parent == JUDGE and Path(name).name != "tests.rs":
                taken[name, line, column, True] += true
                taken[name, line, column, False] += false
    starts = {name: tests_begin(name) for name, *_ in taken}
    return Counter({branch: times for branch, times in taken.items() if branch[1] <= starts[branch[0]]})


def main() -> None:
    """Run the tests, and print the branches that they never take and the share of the others."""
    folder = tools()
    for profile in (BUILT / "profiles").glob("*.profraw"):
        profile.unlink()
    output("cargo", TOOLCHAIN, *TESTS, "--quiet", "redundancy")
    taken = measured(folder)
    for name, line, column, outcome in sorted(branch for branch, times in taken.items() if times == 0):
        text = Path(name).read_text().splitlines()[line - 1].strip()
        print(f"never {str(outcome).lower()}: {Path(name).name}:{line}:{column}: {text}")
    reached = sum(times > 0 for times in taken.values())
    print(f"branches of the isolation: {reached} of {len(taken)}, {reached / len(taken):.1%}")


if __name__ == "__main__":
    main()

"""Prove the layer rules of CONTRIBUTING.md: who may import whom, in Rust and in Python.

Prints one line for every breach and exits 1 if there was any.
"""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "python" / "tumble"

CRATES = {
    "tumble-core": set(),
    "tumble-store": {"tumble-core"},
    "tumble-capi": {"tumble-core", "tumble-store"},
    "tumble-lab": {"tumble-core"},
    "tumble-py": {"tumble-core", "tumble-lab"},
    "tumble-fuzz": {"tumble-core", "tumble-store", "tumble-capi"},
}
"""Which crates of ours each crate may depend on."""

DEVICE_CRATES = {"tumble-capi", "tumble-core", "tumble-store"}
"""No operating system, no heap, and no unsafe code but at the border."""

BORDER_CRATES = {"tumble-capi"}
"""C hands over pointers, which only unsafe code can follow."""

LEAVES = {
    "errors",
    "files",
    "recording",
    "documents",
    "factors",
    "results",
    "results_spin",
    "results_align",
    "results_redundancy",
}
"""Shared data types and file access, which know nothing of ours above them."""

MODULES: dict[str, set[str]] = {
    "errors": set(),
    "files": {"errors"},
    "recording": {"errors"},
    "documents": {"errors", "files", "recording"},
    "factors": {"recording"},
    "results": {"errors", "recording"},
    "results_spin": {"errors", "recording", "results"},
    "results_align": {"errors", "recording", "results"},
    "results_redundancy": {"errors", "recording"},
    "calibration_spin": LEAVES,
    "calibration_redundancy": LEAVES,
    "calibration": LEAVES | {"calibration_spin", "calibration_redundancy", "_core"},
    "poses": LEAVES,
    "logs": {"errors", "files", "recording"},
    "live": {"errors", "recording", "logs"},
    "report": LEAVES,
    "exports": LEAVES | {"calibration"},
    "procedures": LEAVES | {"calibration", "poses", "logs", "live", "_core"},
    "cli": LEAVES | {"calibration", "poses", "logs", "live", "report", "exports", "procedures"},
}
"""Which parts of the package each part may import, besides itself. `tumble` itself may import all of them."""

WHEN_ASKED = {("results", "report"), ("results_spin", "report"), ("results_redundancy", "report")}
"""What one part may fetch of another inside a function only: a notebook asks a result for its table."""

NO_MATHEMATICS = {"numpy", "scipy"}
"""What the command line does not need, since it only passes things on."""


def rust_breaches() -> Iterator[str]:
    """Find dependencies that point down the page, and what a device crate takes beyond `core`."""
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps", "--offline"]
    answer = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for package in json.loads(answer)["packages"]:
        name, folder = package["name"], Path(package["manifest_path"]).parent
        if name not in CRATES:
            yield f"{name}: has no place in the layers; give it one in this script"
            continue
        for dependency in package["dependencies"]:
            used = dependency["name"]
            if used in CRATES and used not in CRATES[name] and dependency["kind"] != "dev":
                yield f"{name}: may not depend on {used}"
            if name in DEVICE_CRATES and _may_need_a_heap(dependency):
                yield f"{name}: takes {used} with its default features, which may need a heap"
        if name in DEVICE_CRATES:
            yield from device_breaches(folder)


def _may_need_a_heap(dependency: dict[str, Any]) -> bool:
    own = dependency["name"] in CRATES
    return not own and dependency["kind"] is None and dependency["uses_default_features"]


def device_breaches(folder: Path) -> Iterator[str]:
    """Find in the crate at `folder` what a device does not have."""
    entrance = folder / "src" / "lib.rs"
    if not re.search(r"^#!\[no_std\]", entrance.read_text(), re.MULTILINE):
        yield f"{entrance.relative_to(ROOT)}: #![no_std] is missing"
    lints = re.search(r"^\[lints\]\nworkspace = true", (folder / "Cargo.toml").read_text(), re.MULTILINE)
    forbidden = re.search(r'^unsafe_code = "forbid"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)
    border = folder.name in BORDER_CRATES
    if not (border or (lints and forbidden)):
        yield f"{folder.name}: unsafe code is not forbidden"
    sources = sorted((folder / "src").rglob("*.rs"))
    tests = {test for path in sources for test in _test_files(path)}
    for path in (path for path in sources if path not in tests):
        for number, line in enumerate(_without_tests(path.read_text()).splitlines(), start=1):
            code = line.split("//")[0]
            unsafe = not border and re.search(r"\bunsafe\b", code)
            if unsafe or re.search(r"\b(std|alloc)::|extern crate (std|alloc)", code):
                yield f"{path.relative_to(ROOT)}:{number}: {line.strip()}"


def _test_files(path: Path) -> Iterator[Path]:
    """Find the files that a source has for its test modules."""
    modules = r'^#\[cfg\(test\)\]\n(?:#\[path = "([^"]+)"\]\n)?mod (\w+);'
    for named, module in re.findall(modules, path.read_text(), re.MULTILINE):
        yield path.parent / (named or f"{module}.rs")


def _without_tests(source: str) -> str:
    """Cut off the test module, which may use what the machine that runs it has."""
    return re.split(r"^#\[cfg\(test\)\]", source, maxsplit=1, flags=re.MULTILINE)[0]


def python_breaches() -> Iterator[str]:
    """Find imports within the package that its layers do not allow."""
    for path in sorted(PACKAGE.rglob("*.py")):
        relative = path.relative_to(PACKAGE)
        part = relative.with_suffix("").parts[0]
        if part == "__init__":
            continue
        if part not in MODULES:
            yield f"{path.relative_to(ROOT)}: has no place in the layers; give it one in this script"
            continue
        for line, module, within_function in _imports(path):
            top, *rest = module.split(".")
            used = rest[0] if top == "tumble" and rest else None
            where = f"{path.relative_to(ROOT)}:{line}"
            if top == "tumble" and used is None:
                yield f"{where}: imports the whole of tumble; name the part"
            elif used is not None and used != part and not _allowed(part, used, within_function):
                yield f"{where}: {part} may not import tumble.{used}"
            if part == "cli" and top in NO_MATHEMATICS:
                yield f"{where}: the command line holds no mathematics, so has no use for {top}"


def _allowed(part: str, used: str, within_function: bool) -> bool:
    return used in MODULES[part] or (within_function and (part, used) in WHEN_ASKED)


def _imports(path: Path) -> Iterator[tuple[int, str, bool]]:
    """Give line, full name (`from tumble import x` is `tumble.x`) and whether indented, of every import."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for name in node.names:
                yield node.lineno, name.name, node.col_offset > 0
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(path, node)
            for name in node.names:
                full = f"{base}.{name.name}" if base == "tumble" else base
                yield node.lineno, full, node.col_offset > 0


def _absolute(path: Path, node: ast.ImportFrom) -> str:
    if not node.level:
        return node.module or ""
    package = ("tumble", *path.relative_to(PACKAGE).parts[:-1])
    above = package[: len(package) - node.level + 1]
    return ".".join((*above, node.module) if node.module else above)


def main() -> int:
    """Print every breach; 1 if there was any."""
    breaches = [*rust_breaches(), *python_breaches()]
    for breach in breaches:
        print(breach, file=sys.stderr)
    print(f"layers: {len(breaches)} breaches" if breaches else "layers: every import points up the page")
    return bool(breaches)


if __name__ == "__main__":
    sys.exit(main())

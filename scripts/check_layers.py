"""Prove the layer rules of CONTRIBUTING.md: who may import whom, in Rust and in Python.

Prints one line for every breach and exits 1 if there was any.
"""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "python" / "tumble"

CRATES = {
    "tumble-processor": set(),
    "tumble-core": {"tumble-processor"},
    "tumble-store": {"tumble-core"},
    "tumble-capi": {"tumble-core", "tumble-store"},
    "tumble-lab": {"tumble-core"},
    "tumble-py": {"tumble-core", "tumble-lab", "tumble-store"},
    "tumble-fuzz": {"tumble-core", "tumble-store", "tumble-capi"},
}
"""Which crates of ours each crate may depend on."""

DEVICE_CRATES = {"tumble-capi", "tumble-core", "tumble-processor", "tumble-store"}
"""No operating system, no heap, and no unsafe code but at the border."""

BORDER_CRATES = {"tumble-capi", "tumble-processor"}
"""What has unsafe code: pointers that C hands over, and instructions of a processor."""

PROCEDURES = {
    *("align", "apply", "demo", "doctor", "inspect", "multipose", "noise", "record", "redundancy"),
    *("compare", "convert", "exchange", "simulate", "spin", "table", "thermal", "turntable"),
}
"""Folders of one procedure each; their files have the layers `result`, `procedure`, `page` and `command`."""

FOLDERS_OF_PROCEDURES = {"simulate"}
"""Procedures that hold a folder for each thing they do."""

FILES_OF_A_RESULT = {"result", "record", "poses", "limits", "spans", "known_faults", "keys"}
"""Plain data of a procedure; files that users write of it among them."""
FILES_OF_A_COMMAND = {"command", "options", "summary", "explain", "targets", "batch", "production"}
"""What a procedure's command is made of; `command_live` is a command too.

A folder `report` holds its pages, all other files are the procedure.
"""

DATA = {
    *("constants", "numbers", "units", "errors", "arrays", "files", "file_names", "recording", "plain"),
    *("provenance", "documents", "bounded_yaml", "schemas", "factors", "results", "goal", "timing", "words"),
    *("folder_lock",),
    "firmware",
    "log_formats",
}
"""Shared data types and file access, which know nothing of ours above them."""

LAYERS: dict[str, set[str]] = {
    "lazy": set(),
    "constants": {"_core"},
    "frames": {"errors"},
    "numbers": set(),
    "units": set(),
    "words": set(),
    "clock_line": set(),
    "errors": {"words"},
    "folder_lock": {"errors"},
    "files": {"errors", "words", "folder_lock"},
    "file_names": set(),
    "log_formats": {"file_names"},
    "arrays": {"errors"},
    "recording": {"errors", "arrays", "units", "words"},
    "firmware": {"errors", "recording", "units"},
    "timing": {"recording"},
    "plain": set(),
    "bounded_yaml": {"plain"},
    "schemas": set(),
    "documents": {"bounded_yaml", "errors", "files", "log_formats", "plain", "recording", "schemas", "words"},
    "setting_table": {"documents", "plain", "_core"},
    "provenance": {"errors", "files", "folder_lock"},
    "setting_models": {"setting_table"},
    "factors": {"recording", "_core"},
    "results": {"errors", "frames", "provenance", "recording", "_core"},
    "goal": {"errors", "numbers", "results", "units"},
    "result": DATA,
    "calibration": DATA | {"result", "_core"},
    "logs": {"lazy", "constants", "numbers", "units", "errors", "arrays", "files", "file_names", "recording"}
    | {"schemas", "documents", "bounded_yaml", "words", "clock_line", "log_formats", "firmware"},
    "live": {
        "numbers",
        "units",
        "errors",
        "files",
        "file_names",
        "recording",
        "timing",
        "words",
        "logs",
        "bounded_yaml",
    }
    | {"clock_line"},
    "gravity": {"errors", "constants", "_core"},
    "acquisition": DATA | {"calibration", "logs", "gravity", "_core"},
    "procedure": DATA
    | {
        "lazy",
        "setting_table",
        "setting_models",
        "result",
        "calibration",
        "logs",
        "live",
        "gravity",
        "acquisition",
        "clock_line",
    }
    | {"_core"},
    "report": DATA,
    "page": DATA | {"result", "report"},
    "cli": DATA | {"logs"},
    "command": DATA
    | {"setting_table", "result", "calibration", "logs", "live", "procedure", "report", "page", "cli"},
}
"""Which layers each layer may import, besides itself. `tumble` itself may import all of them."""

WHEN_ASKED = {("result", "page"), ("result", "command")}
"""What a layer may fetch of another inside a function only: a result shows and saves itself."""

NO_MATHEMATICS = {"numpy", "scipy"}
"""What the command line does not need, since it only passes things on."""

ON_THE_COMMAND_LINE = {"cli", "command"}


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
    """Find imports that the layers do not allow, and folders that import each other around."""
    between: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        layer = _layer(parts)
        if parts == ("__init__",):
            continue
        if layer not in LAYERS:
            yield f"{path.relative_to(ROOT)}: has no place in the layers; give it one in this script"
            continue
        for line, module, within_function in _imports(path):
            top, *used = module.split(".")
            where = f"{path.relative_to(ROOT)}:{line}"
            if top == "tumble" and not used:
                yield f"{where}: imports the whole of tumble; name the part"
            elif top == "tumble" and not _allowed(layer, _layer(used), within_function):
                yield f"{where}: {layer} may not import tumble.{'.'.join(used)}"
            elif top == "tumble" and not within_function and "result" not in (layer, _layer(used)):
                between.setdefault(parts[0], set()).add(used[0])
            if layer in ON_THE_COMMAND_LINE and top in NO_MATHEMATICS:
                yield f"{where}: the command line holds no mathematics, so has no use for {top}"
    yield from _circles(between)


def _layer(parts: Sequence[str]) -> str:
    """Tell the layer of a file or module, given as its path within the package."""
    if parts[0] not in PROCEDURES or len(parts) == 1:
        return "procedure" if parts[0] in PROCEDURES else parts[0]
    inner = parts[0] in FOLDERS_OF_PROCEDURES and (PACKAGE / parts[0] / parts[1]).is_dir()
    file = parts[2] if inner and len(parts) > len(("simulate", "spin")) else parts[1]
    if file in FILES_OF_A_RESULT:
        return "result"
    if file == "report":
        return "page"
    return "command" if file.split("_")[0] in FILES_OF_A_COMMAND else "procedure"


def _allowed(layer: str, used: str, within_function: bool) -> bool:
    return used == layer or used in LAYERS[layer] or (within_function and (layer, used) in WHEN_ASKED)


def _circles(between: dict[str, set[str]]) -> Iterator[str]:
    """Take away folders that import none of those left, until nothing changes: what stays goes around."""
    left = {folder: used & between.keys() - {folder} for folder, used in between.items()}
    while free := {folder for folder, used in left.items() if not used & left.keys()}:
        left = {folder: used for folder, used in left.items() if folder not in free}
    if left:
        yield f"these folders import each other around: {', '.join(sorted(left))}"


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

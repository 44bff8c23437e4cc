"""Prove the layer rules of CONTRIBUTING.md: who may import whom, in Rust and in Python.

Prints one line for every breach and exits 1 if there was any.
"""

from __future__ import annotations

import ast
import graphlib
import json
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from tumble.foundation import procedures

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
    "tumble-web": {"tumble-core", "tumble-lab"},
}
"""Which crates of ours each crate may depend on."""

DEVICE_CRATES = {"tumble-capi", "tumble-core", "tumble-processor", "tumble-store"}
"""No operating system, no heap, and no unsafe code but at the border."""

BORDER_CRATES = {"tumble-capi", "tumble-processor"}
"""Crates with unsafe code: pointers that C hands over, and instructions of a processor."""

TOOLS = {
    *(
        "apply",
        "compare",
        "convert",
        "demo",
        "doctor",
        "exchange",
        "guided",
        "inspect",
        "plateaus",
        "record",
        "simulate",
        "table",
        "view",
        "viewers",
    ),
}
ROOMS = {"foundation", "procedures", "tools"}
"""Folders that hold what the layers name: a file of data, a procedure, a tool."""
PARTS = {"tumble", *(f"tumble.{room}" for room in ROOMS)}
"""Packages from which modules are imported by name."""
PROCEDURES = TOOLS | {procedure.word for procedure in procedures.PROCEDURES}
"""Folders of one procedure or tool each; layers of files: `result`, `procedure`, `page`, `command`."""

LABORATORY, BENCH, FLEET = "laboratory", "bench", "fleet"
"""Rooms whose commands are layers of their own."""

FOLDERS_OF_PROCEDURES = {"simulate"}
"""Procedures that hold a folder for each thing they do."""

FILES_OF_A_RESULT = {"result", "record", "poses", "spans", "known_faults", "keys"}
"""Plain data of a procedure; files that users write of it among them."""
FILE_OF_A_CALIBRATION = "calibration"
"""Makes a calibration file of a result."""
FILE_OF_A_GUIDED_RUN = "guided"
"""Guides an operator and calibrates what was recorded as the command does: `guided_run`, `guided_view`."""
FILES_OF_A_COMMAND = {"command", "options", "summary", "explain", "targets", "batch", "production"}
"""Files of a procedure's command; `command_live` is a command too.

A folder `report` holds its pages, all other files are the procedure.
"""

READING = {
    *("bounded_answer", "bounded_json", "bounded_process", "bounded_time", "file_status", "file_reading"),
    *("parquet_pages", "regular_files", "temporary_folders"),
}
"""Doors through which all files and all JSON of others come, and the bounds for whoever reads them."""

DATA = {
    "message",
    *READING,
    "secrets",
    "serials",
    "log_reading",
    *(
        "days",
        "names",
        "constants",
        "numbers",
        "units",
        "unit_values",
        "errors",
        "arrays",
        "files",
        "file_names",
        "recording",
        "growing_array",
        "stores",
    ),
    "plain",
    *(
        "provenance",
        "documents",
        "bounded_yaml",
        "schemas",
        "error_decomposition",
        "results",
        "goal",
        "timing",
        "words",
        "sample_rates",
    ),
    *(
        "folder_lock",
        "ending",
        "workers",
        "executors",
        "body_axes",
        "log_time",
        "magnetic",
        "procedures",
        "services",
        "noise_terms",
        "gravity",
        "printed",
        "debugging",
    ),
    "firmware",
    "log_formats",
    "project_file",
}
"""Shared data types and file access, which know nothing of ours above them.

No clock is among them: what is made bears the date of its `provenance`, which tests state.
"""

LAYERS: dict[str, set[str]] = {
    "lazy": set(),
    "ending": set(),
    "workers": set(),
    "executors": set(),
    "log_time": set(),
    "procedures": set(),
    "services": {"recording", "results", "units"},
    "clock": set(),
    "noise_terms": {"units"},
    "foundation": set(),
    "tools": set(),
    "constants": {"_core"},
    "frames": {"errors"},
    "numbers": set(),
    "template": set(),
    "message": {"template"},
    "translation": {"catalogue", "errors", "template"},
    "catalogue": READING | {"template"},
    "units": set(),
    "words": {"secrets"},
    "sample_rates": set(),
    "clock_skew": set(),
    "arrival": {"clock_skew", "recording"},
    "days": {"clock"},
    "names": {"words"},
    "body_axes": set(),
    "secrets": set(),
    "errors": {"secrets", "words"},
    "serials": {"errors", "words"},
    "unit_values": {"constants", "units"},
    "log_reading": {"unit_values", "units"},
    "folder_lock": {"errors", "numbers", "regular_files"},
    "file_status": {"errors", "words"},
    "regular_files": {"errors"},
    "temporary_folders": {"errors", "file_status", "regular_files"},
    "bounded_json": {"words"},
    "bounded_answer": {"clock", "regular_files"},
    "bounded_process": {"clock", "workers"},
    "parquet_pages": set(),
    "bounded_time": {"clock"},
    "file_reading": {"errors", "file_status", "files", "regular_files"},
    "files": {"errors", "words", "folder_lock", "debugging", "file_status", "regular_files"},
    "growing_array": {"recording"},
    "stores": {"bounded_answer", "errors", "file_reading", "files", "temporary_folders", "words"},
    "file_names": {"procedures"},
    "log_formats": {"body_axes", "file_names", "words"},
    "project_file": READING | {"errors", "words"},
    "arrays": {"errors"},
    "magnetic": {"arrays", "errors", "units", "words"},
    "recording": {"errors", "arrays", "frames", "log_reading", "magnetic", "names", "units", "words"},
    "firmware": {"errors", "magnetic", "recording", "units"},
    "timing": {"recording"},
    "plain": set(),
    "bounded_yaml": {"words"},
    "schemas": {"procedures", "printed"},
    "field_docstrings": set(),
    "printed": {"field_docstrings"},
    "debugging": set(),
    "documents": {
        "bounded_yaml",
        "errors",
        "field_docstrings",
        "file_status",
        "files",
        "log_formats",
        "plain",
        "recording",
    }
    | {"schemas", "words", "names", "file_reading"},
    "setting_table": {"documents", "words", "_core"},
    "provenance": {"clock", "days", "errors", "files", "file_status", "folder_lock", "log_reading"}
    | {"log_time", "regular_files"},
    "setting_models": {"setting_table"},
    "error_decomposition": {"recording", "_core"},
    "results": {"errors", "frames", "log_time", "provenance", "recording", "units", "words", "_core"},
    "goal": {"errors", "numbers", "results", "units"},
    "result": DATA | {"calibration", "arrival"},
    "calibration": DATA | {"_core"},
    "poses": DATA | {"_core"},
    "to_calibration": DATA | {"result", "calibration"},
    "logs": READING
    | {"lazy", "constants", "numbers", "units", "errors", "arrays", "files", "file_names", "recording"}
    | {"schemas", "documents", "bounded_yaml", "words", "clock_skew", "log_formats", "firmware"}
    | {
        "body_axes",
        "executors",
        "log_reading",
        "unit_values",
        "log_time",
        "magnetic",
        "names",
        "debugging",
        "_core",
    },
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
    | {"clock", "clock_skew", "debugging", "magnetic"}
    | READING,
    "gravity": {"errors", "constants", "_core"},
    "acquisition": DATA | {"calibration", "logs", "arrival", "_core"},
    "procedure": DATA
    | {
        "lazy",
        "setting_table",
        "setting_models",
        "result",
        "calibration",
        "poses",
        "logs",
        "live",
        "acquisition",
        "clock",
        "clock_skew",
        "arrival",
    }
    | {"_core"},
    "report": DATA | {"translation"},
    "page": DATA | {"result", "report", "poses", "translation"},
    "laboratory": DATA | {"calibration", "report", "translation", "_core"},
    "cli": DATA | {"clock", "logs", "translation"},
    "fleet": DATA | {"calibration", "clock", "report", "laboratory", "logs", "cli", "translation", "_core"},
    "bench": DATA
    | {"calibration", "clock", "fleet", "laboratory", "live", "logs", "procedure", "report", "result"}
    | {"translation"},
    "__main__": {"cli"},
    "command": DATA
    | {
        "setting_table",
        "result",
        "calibration",
        "poses",
        "logs",
        "live",
        "procedure",
        "report",
        "page",
        "laboratory",
        "fleet",
        "bench",
        "cli",
        "clock",
        "translation",
    },
}
"""Which layers each layer may import, besides itself. `tumble` itself may import all of them."""
LAYERS["guided"] = (LAYERS["command"] | LAYERS["procedure"] | {"command"}) - {"cli"}

WHEN_ASKED = {("result", "page"), ("result", "command"), ("result", "to_calibration")}
"""Imports of a layer that are allowed inside a function only: a result shows and saves itself, and makes its
calibration."""

NO_MATHEMATICS = {"numpy", "scipy"}
"""Libraries that the command line does not need, since it only passes things on."""

ON_THE_COMMAND_LINE = {"cli", "command"}

LABORATORY_CRATE = ROOT / "crates" / "tumble-lab" / "src"

DOORS = {
    "exists": "file_status",
    "is_file": "file_status",
    "is_dir": "file_status",
    "is_symlink": "file_status",
    "is_fifo": "file_status",
    "iterdir": "file_status",
    **dict.fromkeys(("isdigit", "isdecimal", "isnumeric"), "numbers"),
    "expanduser": "file_status",
    "Path.home": "file_status",
    "Path.cwd": "file_status",
    "read_bytes": "file_reading",
    "read_text": "file_reading",
    "json.load": "bounded_json",
    "json.loads": "bounded_json",
}
"""Methods and functions that only one module of the foundation calls: others raise for what a user can do."""

OPENERS = {
    "open": {"regular_files"},
    "open to read": {"regular_files"},
    "os.open": {"regular_files", "files", "folder_lock", "standard_output", "iio_device"},
    "os.fdopen": {"files", "standard_output"},
    "apsw.Connection": {"bag_files", "bag_journal"},
    "sqlite3.connect": {"database"},
    "shutil.copyfile": set(),
    "pa.OSFile": set(),
    "pa.memory_map": set(),
}
"""Ways to open a file by its name, with the modules that may: a pipe or device can stand there by then.

Others call `foundation.regular_files.open_regular`.
"""
LIBRARIES_OF_FILES = {
    *("h5py.File", "zipfile.ZipFile", "tarfile.open", "np.load", "np.fromfile", "np.memmap"),
    *("pq.ParquetFile", "pq.read_schema", "pq.read_metadata", "pq.read_table", "gzip.open", "bz2.open"),
    *("pa.ipc.open_file", "lzma.open", "pa.input_stream", "Image.open", "etree.parse"),
}
"""Functions of libraries that take a name or an opened file, and are given the file."""
OPENED = {"file", "stream", "self._file"}
"""Names that opened files bear where a library is given one."""
_READING_MODE = re.compile(r"[rbtU]+")

RUST_TYPE = r"^(?: *pub(?:\([\w: ]+\))? )?(?:struct|enum|union|trait|type) (\w+)"
"""Definition of a type, with its name; public ones stand within macros too."""


def rust_breaches() -> Iterator[str]:
    """Finds dependencies that point down the page, and what a device crate takes beyond `core`."""
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
    """Finds in the crate at `folder` what a device does not have."""
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
    """Finds the files that a source has for its test modules."""
    modules = r'^#\[cfg\(test\)\]\n(?:#\[path = "([^"]+)"\]\n)?mod (\w+);'
    for named, module in re.findall(modules, path.read_text(), re.MULTILINE):
        yield path.parent / (named or f"{module}.rs")


def _without_tests(source: str) -> str:
    """Cuts off the test module, which may use what the machine that runs it has."""
    return re.split(r"^#\[cfg\(test\)\]", source, maxsplit=1, flags=re.MULTILINE)[0]


def python_breaches() -> Iterator[str]:
    """Finds imports that the layers do not allow, and folders that import each other around."""
    folders: dict[str, set[str]] = {}
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
            elif top == "tumble":
                folders.setdefault(_folder(parts), set()).add(_folder(used))
            if layer in ON_THE_COMMAND_LINE and top in NO_MATHEMATICS:
                yield f"{where}: the command line holds no mathematics, so has no use for {top}"
    yield from _circles(uses_between_rooms())
    yield from _circles(folders)


def uses_between_rooms() -> dict[str, set[str]]:
    """Which rooms of the package each room imports; the native module is `_core`."""
    found: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        room = path.relative_to(PACKAGE).with_suffix("").parts[0]
        names = (module.split(".") for _, module, _ in _imports(path))
        used = {name[1] for name in names if name[0] == "tumble" and len(name) > 1}
        found.setdefault(room, set()).update(used - {room})
    return found


def door_breaches(package: Path | None = None) -> Iterator[str]:
    """Finds files that are looked for or read, and JSON that is read, past the module that bounds it."""
    package = package or PACKAGE
    for path in sorted(package.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            where = f"{path.relative_to(package)}:{node.end_lineno}"
            if path.stem not in OPENERS.get(way := _way_of_opening(node), {path.stem}):
                yield f"{where}: calls {way}; tumble.foundation.regular_files opens for all"
            if _gives_a_name(node):
                yield (
                    f"{where}: gives {ast.unparse(node.func)} a name; give it what "
                    "tumble.foundation.regular_files opened"
                )
            if not isinstance(node.func, ast.Attribute):
                continue
            of = f"{node.func.value.id}." if isinstance(node.func.value, ast.Name) else ""
            name = next((each for each in (f"{of}{node.func.attr}", node.func.attr) if each in DOORS), "")
            if (door := DOORS.get(name)) and path.stem != door:
                yield f"{where}: calls {name}; tumble.foundation.{door} does so for all"


def _way_of_opening(node: ast.Call) -> str:
    """Returns the way of `OPENERS` by which a call opens a file; empty for none."""
    name = ast.unparse(node.func)
    if name in OPENERS:
        return name
    if not isinstance(node.func, ast.Attribute) or node.func.attr != "open" or name in LIBRARIES_OF_FILES:
        return ""
    modes = [each.value for each in node.args if isinstance(each, ast.Constant)]
    modes += [each.value.value for each in node.keywords if isinstance(each.value, ast.Constant)]
    of_file = re.search(r"(path|file|place)$", ast.unparse(node.func.value), re.IGNORECASE)
    is_text = any(each.arg in ("encoding", "newline", "buffering") for each in node.keywords)
    reads = any(isinstance(mode, str) and _READING_MODE.fullmatch(mode) for mode in modes)
    opens_file = len(node.args) < 2 and (reads or ((is_text or of_file is not None) and not node.args))
    return "open to read" if opens_file else ""


def _gives_a_name(node: ast.Call) -> bool:
    """Returns whether a call gives a library anything but an opened file."""
    if ast.unparse(node.func) not in LIBRARIES_OF_FILES:
        return False
    return not (node.args and ast.unparse(node.args[0]) in OPENED)


def name_breaches(package: Path = PACKAGE) -> Iterator[str]:
    """Finds names of types that stand for two things: public classes and aliases of several modules."""
    homes: dict[str, list[str]] = {}
    for path in sorted(package.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if (name := _type_named(node)) and not name.startswith("_"):
                homes.setdefault(name, []).append(str(path.relative_to(package)))
    for name, found in homes.items():
        if len(found) > 1:
            yield f"{name}: is a type of {', '.join(found)}; a type's name means one thing"


def rust_name_breaches(root: Path = ROOT) -> Iterator[str]:
    """Finds names of Rust types that stand for two things, tests aside.

    Types of the C interface bear the names of those that they stand for; among themselves they differ.
    """
    homes: dict[tuple[bool, str], list[str]] = {}
    for folder in sorted([*root.glob("crates/*/src"), *root.glob("firmware/*/src")]):
        sources = sorted(folder.rglob("*.rs"))
        tests = {test for path in sources for test in _test_files(path)}
        for path in (path for path in sources if path not in tests):
            for name in re.findall(RUST_TYPE, _without_tests(path.read_text(encoding="utf-8")), re.MULTILINE):
                is_of_c = folder.parent.name == "tumble-capi"
                homes.setdefault((is_of_c, name), []).append(path.relative_to(root).as_posix())
    for (_, name), found in homes.items():
        if len(found) > 1:
            yield f"{name}: is a type of {', '.join(found)}; a type's name means one thing"


def rust_circles(source: Path = LABORATORY_CRATE) -> Iterator[str]:
    """Finds files of a folder that use one another around; a folder in it counts as one file."""
    for room in sorted(path for path in source.rglob("*") if path.is_dir()):
        modules: dict[str, str] = {}
        for path in sorted({*room.rglob("*.rs")} - {room / "mod.rs"}):
            code = re.sub(r"//.*", "", _without_tests(path.read_text(encoding="utf-8")))
            modules[_module_of(path, room)] = modules.get(_module_of(path, room), "") + code
        within = "::".join(("crate", *room.relative_to(source).parts))
        uses = {
            name: {other for other in modules if re.search(rf"\b(?:super|{within})::{other}\b", code)}
            for name, code in modules.items()
            if not name.endswith("tests")
        }
        yield from (f"{room.name}: {circle}" for circle in _circles(uses))


def _module_of(path: Path, room: Path) -> str:
    return path.relative_to(room).with_suffix("").parts[0]


def _type_named(node: ast.stmt) -> str:
    """Returns the name of a class or alias that a statement defines; empty for another statement."""
    if isinstance(node, ast.ClassDef):
        return node.name
    if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
        return node.target.id if ast.unparse(node.annotation) == "TypeAlias" else ""
    return ""


def _layer(parts: Sequence[str]) -> str:
    """Returns the layer of a file or module, given as its path within the package."""
    room, *rest = parts
    if parts[0] in (LABORATORY, BENCH, FLEET) and parts[-1].split("_")[0] in FILES_OF_A_COMMAND:
        return "command"
    if room not in ROOMS or rest in ([], ["__init__"]):
        return room
    if room == "foundation":
        return rest[0]
    return _layer_within(room, *rest) if rest[0] in PROCEDURES else "/".join(parts)


def _layer_within(room: str, folder: str, *files: str) -> str:
    """Returns the layer of a file of a procedure or tool."""
    if not files:
        return "procedure"
    inner = folder in FOLDERS_OF_PROCEDURES and (PACKAGE / room / folder / files[0]).is_dir()
    file = files[1] if inner and len(files) > 1 else files[0]
    if file in FILES_OF_A_RESULT:
        return "result"
    if file == "report":
        return "page"
    if file == FILE_OF_A_CALIBRATION:
        return "to_calibration"
    if room == "procedures" and file.split("_")[0] == FILE_OF_A_GUIDED_RUN:
        return "guided"
    return "command" if file.split("_")[0] in FILES_OF_A_COMMAND else "procedure"


def _allowed(layer: str, used: str, within_function: bool) -> bool:
    return used == layer or used in LAYERS[layer] or (within_function and (layer, used) in WHEN_ASKED)


def _folder(parts: Sequence[str]) -> str:
    """Names the folder of a procedure, a tool or a room; a file of data stands for itself."""
    return "/".join(parts[:2]) if parts[0] in ROOMS else parts[0]


def _circles(between: dict[str, set[str]]) -> Iterator[str]:
    try:
        graphlib.TopologicalSorter({name: used - {name} for name, used in between.items()}).prepare()
    except graphlib.CycleError as error:
        yield f"these import each other around: {' <- '.join(error.args[1])}"


def _imports(path: Path) -> Iterator[tuple[int, str, bool]]:
    """Line, full name (`from tumble import x` is `tumble.x`) and whether indented, of every import."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for name in node.names:
                yield node.lineno, name.name, node.col_offset > 0
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(path, node)
            for name in node.names:
                full = f"{base}.{name.name}" if base in PARTS else base
                yield node.lineno, full, node.col_offset > 0


def _absolute(path: Path, node: ast.ImportFrom) -> str:
    if not node.level:
        return node.module or ""
    package = ("tumble", *path.relative_to(PACKAGE).parts[:-1])
    above = package[: len(package) - node.level + 1]
    return ".".join((*above, node.module) if node.module else above)


def main() -> int:
    """Prints every breach; 1 if there was any."""
    of_rust = [*rust_breaches(), *rust_name_breaches(), *rust_circles()]
    breaches = [*of_rust, *python_breaches(), *name_breaches(), *door_breaches()]
    for breach in breaches:
        print(breach, file=sys.stderr)
    print(f"layers: {len(breaches)} breaches" if breaches else "layers: every import points up the page")
    return bool(breaches)


if __name__ == "__main__":
    sys.exit(main())

"""Results of a fleet that others wrote, or that are corrupted: summed up, or refused in one line."""

from __future__ import annotations

import ast
import json
import math
import os
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fleet_functions
from fleet_jobs import SerialEngine, function_job, results_of, run_job
from hostile import MOST_BYTES, corrupted, few, for_long
from made_up_fleets import write_fleets
from repetitions import SOAK, by_turns
from tumble import fleet
from tumble.fleet import parts
from tumble.fleet.inputs import COLUMNS, InputsError, inputs_of
from tumble.fleet.job import FleetJob, load_job, option_words
from tumble.fleet.ledger import JobStatus, begin, write_status
from tumble.fleet.parts import LARGEST_PART, SCHEMA, whole_table
from tumble.fleet.places import FileStore
from tumble.foundation.parquet_pages import pages_of
from tumble.foundation.stores import StoreError
from turntable_sessions import one_line, typed

TEXTS = st.sampled_from(
    ["", "yesterday", "9999-12-31", "\x1b[31m\n<script>alert(1)</script>", "=1+1", "../x"]
)
NUMBERS = st.sampled_from([0.0, -1.0, 1.0, 5e-324, 1e308, math.nan, math.inf, -math.inf, None])
STATED = ("unit", "serial", "model", "lot", "operator", "station", "day", "verdict", "failure", "summary")


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """Rows of a sound part, a few of them."""
    folder = tmp_path_factory.mktemp("sound")
    write_fleets(folder)
    job = next(path for path in sorted(folder.rglob("parts")))
    return whole_table(FileStore(str(job.parent))).slice(0, 8).to_pylist()


@st.composite
def hostile_rows(draw, rows):
    """Rows with the types of a part, and with contents that no command writes."""
    found = []
    for row in draw(st.lists(st.sampled_from(rows), min_size=1, max_size=5)):
        texts = {name: draw(TEXTS) for name in draw(st.sets(st.sampled_from(STATED), max_size=4))}
        parameters = [
            each | {name: draw(NUMBERS) for name in draw(st.sets(st.sampled_from(["value", "u", "common"])))}
            for each in row["parameters"][:4]
        ]
        key = draw(st.one_of(st.just(row["key"]), st.binary(min_size=16, max_size=16)))
        found.append(row | texts | {"parameters": parameters, "key": key})
    return found


def written(folder, table, **options):
    path = folder / "parts" / "day=x" / "a.parquet"
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path, compression="zstd", **options)
    return path


def summed_up(folder):
    """Sums up results; returns the exit code."""
    limits, page = folder / "limits.yaml", folder / "page.html"
    limits.write_text("schema: tumble-limits/1\naccelerometer: {bias: 1.0}\n")
    page.unlink(missing_ok=True)
    done = typed("fleet", "show", folder, "--limits", limits, "--page", page)
    if done.code == 2:
        one_line(done.err)
    else:
        assert done.code in (0, 3)
        assert "<script>alert" not in page.read_text()
    return done.code


def test_hostile_contents_of_a_part_are_summed_up(tmp_path, rows):
    @few
    @given(found=hostile_rows(rows))
    def check(found):
        written(tmp_path, pa.Table.from_pylist(found, SCHEMA))
        assert summed_up(tmp_path) in (0, 3)

    for_long(check, 0.5)


def test_a_corrupted_part_is_read_or_refused_in_one_line(tmp_path, rows):
    path = written(tmp_path, pa.Table.from_pylist(rows, SCHEMA))

    @few
    @given(data=corrupted(path.read_bytes()))
    def check(data):
        path.write_bytes(data)
        summed_up(tmp_path)

    for_long(check, 0.5)


def test_a_table_of_other_columns_is_no_part(tmp_path, rows):
    whole = pa.Table.from_pylist(rows, SCHEMA)
    for number, field in enumerate(SCHEMA):
        others = [whole.drop([field.name])]
        for kind in (pa.string(), pa.int64(), pa.list_(pa.float64())):
            if kind != field.type:
                others.append(whole.set_column(number, field.name, pa.nulls(len(rows), kind)))
        others.append(
            whole.set_column(number, pa.field(field.name, field.type), pa.nulls(len(rows), field.type))
        )
        for place, other in enumerate(others):
            written(tmp_path, other)
            with pytest.raises(StoreError, match=f"(column|value of) {field.name}"):
                list(parts.tables(FileStore(str(tmp_path))))
            # The command refuses all of them by that error: it meets one of each column.
            if SOAK or place == number % len(others):
                assert summed_up(tmp_path) == 2


def test_a_part_that_unpacks_without_bound_is_refused(tmp_path, rows, monkeypatch):
    path = written(tmp_path, pa.Table.from_pylist([rows[0] | {"messages": "x" * (8 << 20)}], SCHEMA))
    assert path.stat().st_size < 1 << 18
    monkeypatch.setattr(parts, "LARGEST_PART", 1 << 20)
    with pytest.raises(StoreError, match="unpacks to 8 MiB"):
        whole_table(FileStore(str(tmp_path)))
    assert LARGEST_PART > MOST_BYTES


def repeated(text, times):
    """A text for each of so many rows, of which Parquet stores one."""
    return pa.DictionaryArray.from_arrays(pa.array(np.zeros(times, np.int32)), pa.array([text]))


def with_repeated(rows, where):
    """A part of a few kilobytes in which one text of a megabyte stands for many, or a number for millions."""
    whole = pa.Table.from_pylist(rows[:1], SCHEMA)
    if where == "unit":
        whole = pa.concat_tables([whole] * 2000)
        return whole.set_column(SCHEMA.get_field_index("unit"), "unit", repeated("x" * (1 << 20), 2000))
    count = 2000 if where == "name" else 3_000_000
    names = repeated("x" * (1 << 20) if where == "name" else "x", count)
    unit, zeros = repeated("m", count), pa.array(np.zeros(count))
    parameters = pa.StructArray.from_arrays(
        [names, unit, zeros, zeros, zeros], ["name", "unit", "value", "u", "common"]
    )
    offsets = pa.array([0, count], pa.int32())
    column = pa.ListArray.from_arrays(offsets, parameters)
    return whole.set_column(SCHEMA.get_field_index("parameters"), "parameters", column)


@pytest.mark.parametrize("where", ["unit", "name", "count"])
def test_a_text_that_stands_for_many_is_bounded_before_it_is_unpacked(tmp_path, rows, where):
    path = written(tmp_path, with_repeated(rows, where), store_schema=False)
    assert path.stat().st_size < 1 << 18
    with path.open("rb") as file:
        found = parts.packed_file(file, "a part").read()
    assert found.nbytes < 10 * MOST_BYTES
    with pytest.raises(StoreError, match=r"unpacks to \d+ MiB, and to 1024 at most"):
        list(parts.tables(FileStore(str(tmp_path))))


def stated_less(path, number):
    """Has the end of a file of Parquet state 1 in the place of a number, which takes as many bytes."""
    content = path.read_bytes()
    length = int.from_bytes(content[-8:-4], "little")
    end = content[-8 - length :]
    digits = []
    while number:
        digits.append(number & 127)
        number >>= 7
    found = bytes([*(each | 128 for each in digits[:-1]), digits[-1]])
    less = bytes([2 | 128, *[128] * (len(digits) - 2), 0])
    assert found in end
    path.write_bytes(content[: -8 - length] + end.replace(found, less))


def test_the_end_of_a_part_does_not_bound_what_is_read(tmp_path, rows):
    path = written(tmp_path, with_repeated(rows, "count"), store_schema=False, write_statistics=False)
    stated_less(path, 2 * 3_000_000)
    data = pq.ParquetFile(path).metadata
    names = [data.row_group(0).column(place) for place in range(data.num_columns)]
    assert sum(each.num_values for each in names if each.path_in_schema.startswith("parameters")) == 5
    with pytest.raises(StoreError, match=r"unpacks to \d+ MiB, and to 1024 at most"):
        list(parts.tables(FileStore(str(tmp_path))))


@pytest.mark.parametrize("name", [field.name for field in SCHEMA if field.type == pa.string()])
def test_a_text_stated_by_its_difference_to_the_last_is_refused(tmp_path, rows, name):
    table = pa.Table.from_pylist(
        [each | {name: "x" * (1 << 20) + str(n)} for n, each in enumerate(rows)], SCHEMA
    )
    coded = {"use_dictionary": False, "column_encoding": {name: "DELTA_BYTE_ARRAY"}, "store_schema": False}
    path = written(tmp_path, table, **coded)
    assert path.stat().st_size < 1 << 18
    with pytest.raises(StoreError, match="write it without DELTA_BYTE_ARRAY"):
        list(parts.tables(FileStore(str(tmp_path))))
    if name in (*COLUMNS, "place"):
        with pytest.raises(StoreError, match="write it without DELTA_BYTE_ARRAY"):
            list(inputs_of(FleetJob(procedure="spin", inputs=str(path), results="r")))


@pytest.mark.parametrize("kind", [pa.list_(pa.string()), pa.struct([("a", pa.string())]), pa.binary(1 << 16)])
def test_a_column_of_a_manifest_holds_texts(tmp_path, kind):
    manifest = tmp_path / "manifest.parquet"
    for name in ("place", "options", *COLUMNS):
        table = {"place": pa.array(["x"])} | {name: pa.nulls(1, kind)}
        pq.write_table(pa.table(table), manifest)
        with pytest.raises(InputsError, match=f"column {name} holds no texts but"):
            list(inputs_of(FleetJob(procedure="spin", inputs=str(manifest), results="r")))


def test_heads_of_pages_state_what_the_end_of_an_honest_file_does(tmp_path):
    draws = np.random.default_rng(7)
    count = 30_000
    table = pa.table(
        {
            "number": draws.normal(size=count),
            "text": [str(each % 999) for each in range(count)],
            "list": [[1.0] * (each % 3) for each in range(count)],
            "none": pa.nulls(count, pa.int32()),
            "flag": draws.integers(0, 2, count).astype(bool),
        }
    )
    path = tmp_path / "honest.parquet"
    for options in (
        {}, {"data_page_version": "2.0"}, {"use_dictionary": False}, {"compression": "none"},
        {"row_group_size": 1000}, {"write_page_checksum": True}, {"data_page_size": 1000},
    ):  # fmt: skip
        pq.write_table(table, path, **options)
        data = pq.ParquetFile(path).metadata
        with path.open("rb") as file:
            for group, place in np.ndindex(data.num_row_groups, data.num_columns):
                chunk = data.row_group(group).column(place)
                found = list(pages_of(file, chunk, data.created_by))
                without_dictionary = found[1:] if chunk.has_dictionary_page else found
                assert sum(page.values for page in without_dictionary) == chunk.num_values
                assert (
                    0 <= chunk.total_uncompressed_size - sum(page.size for page in found) <= 100 * len(found)
                )


def test_a_text_of_a_manifest_that_stands_for_many_is_bounded(tmp_path):
    manifest = tmp_path / "manifest.parquet"
    place = repeated("x" * (8 << 20), 256)
    pq.write_table(pa.table({"place": place}), manifest, compression="zstd", store_schema=False)
    job = FleetJob(procedure="spin", inputs=str(manifest), results=str(tmp_path / "results"))
    with pytest.raises(StoreError, match="unpacks to 2056 MiB"):
        list(inputs_of(job))


def test_an_outcome_that_is_none_is_a_failure_in_one_line(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    count = len(fleet_functions.HOSTILE)
    job = function_job("results", "hostile", seeds=(0, count + 1))
    status = run_job(job)
    monkeypatch.chdir(tmp_path)
    found = results_of(job).to_pylist()
    assert (status.done, status.failed, status.retried, len(found)) == (count + 1, count, 0, count + 1)
    for each in found:
        assert each["failure"] == "" or each["failure"].startswith("fleet_functions:hostile failed: ")
        assert each["failure"].isprintable()
    out, err = capfd.readouterr()
    assert out == ""
    assert "Traceback" not in err


def test_texts_of_results_begin_no_line_of_their_own(tmp_path, rows):
    text = "x\nFailed: 99: as if"
    changed = [rows[0] | {"failure": text, "place": text}, rows[1] | {"verdict": text, "model": text}]
    written(tmp_path, pa.Table.from_pylist(changed, SCHEMA))
    done = typed("fleet", "show", tmp_path)
    assert "as if" in done.out
    assert not any(line.startswith("Failed: 99") for line in done.out.splitlines())


def test_fleet_commands_print_by_one_function():
    for path in Path(fleet.__file__).parent.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
        assert not [node for node in calls if isinstance(node.func, ast.Name) and node.func.id == "print"]


def test_a_folder_whose_name_is_no_utf_8_is_a_row(tmp_path, monkeypatch):
    folder = tmp_path / os.fsdecode(b"rob\xe9t")
    folder.mkdir()
    monkeypatch.chdir(folder)
    (folder / "log.csv").write_text("no log")
    (folder / "job.yaml").write_text("procedure: spin\ninputs: log.csv\nresults: results\n")
    run_job(load_job("job.yaml"), SerialEngine())
    (found,) = results_of(load_job("job.yaml")).to_pylist()
    assert found["place"].endswith("rob\\xe9t/log.csv")
    assert "not a log" in found["failure"]


def test_arguments_without_the_other_quotation_mark_are_refused(tmp_path):
    job = tmp_path / "job.yaml"
    job.write_text('procedure: spin\narguments: "\'{input}"\ninputs: [x.csv]\nresults: results\n')
    done = typed("fleet", "run", job)
    assert done.code == 2
    assert "arguments" in one_line(done.err)
    assert list(option_words({"rate": 52.123456789, "still": 5.0, "n": 2})) == [
        "--rate=52.123456789",
        "--still=5",
        "--n=2",
    ]


@pytest.fixture
def begun(tmp_path):
    """The file of a job that is stated to run, and its status, and how far it is as the file states it."""
    job = tmp_path / "job.yaml"
    job.write_text(
        f"procedure: fleet_functions:squared\nseeds: {{count: 1}}\nresults: {tmp_path / 'results'}\n"
    )
    results = FileStore(str(tmp_path / "results"))
    begin(results, load_job(job))
    write_status(results, JobStatus("running", 1, 0, 0, 0, 0, 1.0, 1.0, "local"))
    path = tmp_path / "results" / "status.json"
    return job, path, json.loads(path.read_text())


@pytest.mark.parametrize("words", [("status",), ("status", "--json"), ("cancel",)])
def test_no_number_or_text_of_a_status_breaks_what_is_shown(begun, words):
    job, path, whole = begun
    numbers = ["NaN", "Infinity", "-Infinity", "1e999", "1e308", "5e-324", "-1", "9" * 60]
    texts = [
        "x\ntumble: done: 1 of 1 inputs",
        "x\rtumble: done",
        "\u202edone\u2028tumble: done",
        "x\ttumble: done",
    ]
    for place, (key, before) in enumerate(whole.items()):
        given = numbers if isinstance(before, int | float) else [json.dumps(text) for text in texts]
        for value in by_turns(given, place, 2):
            content = json.dumps(whole | {key: "HERE"}).replace('"HERE"', value)
            path.write_text(content)
            done = typed("fleet", words[0], job, *words[1:])
            if done.code == 2:
                one_line(done.err)
            else:
                assert (done.code, done.err) == (0, "")
                assert "--json" in words or done.out.count("\n") == 1
                assert done.out.rstrip("\n").isprintable() or json.loads(done.out)


@pytest.mark.parametrize("name", ["job.json", "status.json"])
def test_a_ledger_of_other_contents_is_one_line(begun, name):
    job, status, _ = begun
    path = status.with_name(name)
    whole = json.loads(path.read_text())
    for place, key in enumerate(whole):
        for value in by_turns((None, [], {"a": 1}, "x"), place, 2):
            content = whole | {key: value}
            if value is None:
                del content[key]
            path.write_text(json.dumps(content))
            words = ("run", job, "--resume") if name == "job.json" else ("status", job)
            done = typed("fleet", *words)
            if done.code == 2:
                one_line(done.err)
            else:
                assert done.code == 0
                assert isinstance(value, str) or key in (
                    "written by",
                    "seconds",
                    "reason",
                    "written",
                    "state",
                    "engine",
                )


def test_files_of_others_beside_results_are_kept(tmp_path):
    mine = b"notes of the tumble fleet, mine alone"
    job = tmp_path / "job.yaml"
    job.write_text(
        f"procedure: fleet_functions:squared\nseeds: {{count: 2}}\nresults: {tmp_path / 'results'}\n"
    )
    (tmp_path / "results").mkdir()
    kept = tmp_path / "results" / "cancel"
    kept.write_bytes(mine)
    assert typed("fleet", "run", job, "--workers", "1", "--quiet").code == 0
    for name, words in (("cancel", "cancel"), ("status.json", "run"), ("job.json", "run")):
        path = tmp_path / "results" / name
        before = path.read_bytes()
        path.write_bytes(mine)
        if name == "cancel":
            write_status(FileStore(str(path.parent)), JobStatus("running", 1, 0, 0, 0, 0, 1.0, 1.0, "local"))
        done = typed("fleet", words, job, *(("--workers", "1", "--resume") if words == "run" else ()))
        assert (done.code, path.read_bytes()) == (2, mine)
        one_line(done.err)
        path.write_bytes(before)

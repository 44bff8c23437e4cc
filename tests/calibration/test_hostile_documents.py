"""Documents from anywhere end in their content or in one line, after bounded work, whatever they hold."""

from __future__ import annotations

import os

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

import tumble
from tumble.cli.commands import COMMANDS
from tumble.foundation import bounded_yaml, documents
from tumble.foundation.schemas import SCHEMAS
from turntable_sessions import one_line, typed

HEAD = "schema: tumble-calibration/1\nname: unit\n"
ACCELEROMETER = "accelerometer: {unit: m/s^2, M: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], b: [0, 0, 0]}\n"
PART_WORK = bounded_yaml.MOST_NODES + 1000

ALIASES = "".join(
    f"{here}: &{here} [{', '.join([f'*{there}'] * 20)}]\n"
    for there, here in zip("abcdefghi", "bcdefghij", strict=True)
)
HOSTILE = {
    "a complex key": "? [1, 2]\n: 3\n",
    "a date that is none": "serial: !!timestamp 2020-99-99\n",
    "an empty hexadecimal number": "name: 0x_\n",
    "no whole number": "name: !!int abc\n",
    "no number": "name: !!float abc\n",
    "neither true nor false": "name: !!bool maybe\n",
    "5000 digits": f"name: {'9' * 5000}\n",
    "400 digits": f"accelerometer: {{b: [{'1' * 400}.0, 0, 0]}}\n",
    "deep lists": "[" * 200_000,
    "deep mappings": "{a: " * 200_000,
    "deep dashes": "- " * 100_000,
    "aliases of aliases": f"a: &a [0, 1]\n{ALIASES}",
    "an alias of itself": "a: &a [*a]\n",
    "deep aliases": f"a: &a {'[' * 40}{']' * 40}\nb: {'[' * 40}*a{']' * 40}\n",
    "many keys": "a:\n" * 500_000,
    "many anchors": f"[{'&a 1,' * 500_000}]",
    "too many bytes": f"# {'x' * (5 << 20)}\n",
    "bytes that are no text": "\udcff",
    "a NUL": "name: a\0b\n",
    "half of a character": 'name: "\\ud800"\n',
    "a character beyond all": 'name: "\\UFFFFFFFF"\n',
    "a version of 5000 digits": f"%YAML {'1' * 5000}.1\n---\n",
    "a tag of nobody": "name: !!python/object/apply:os.system [true]\n",
    "two documents": "a: 1\n---\nb: 2\n",
    "a key without end": f"{'k' * 1_000_000}: 1\n",
    "an unknown key without end": f"? {'k' * 1_000_000}\n: 1\n",
    "infinity": "accelerometer: {b: [.inf, 0, 0]}\n",
    "beyond what can be squared": ACCELEROMETER.replace("[0, 0, 0]", "[1e308, 0, 0]"),
    "no bias of any sensor": ACCELEROMETER.replace("b: [0, 0, 0]", "b: [1e8, 0, 0]"),
}


@pytest.fixture(autouse=True)
def work(monkeypatch):
    """Events and nodes that are read are counted, and held against the bound in the end."""
    count = [0]
    extent, construct = bounded_yaml._extent_of, bounded_yaml._Loader.construct_object

    def counted(step):
        def take(*arguments, **options):
            count[0] += 1
            return step(*arguments, **options)

        return take

    monkeypatch.setattr(bounded_yaml, "_extent_of", counted(extent))
    monkeypatch.setattr(bounded_yaml._Loader, "construct_object", counted(construct))
    return count


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_document_is_one_line(tmp_path, name, work):
    path = tmp_path / "unit.yaml"
    text = HOSTILE[name]
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    line = one_line(typed("apply", path, path).err)
    assert line.startswith(f"{path}: ")
    assert len(line) < 1000
    assert work[0] < 2 * PART_WORK
    if text.startswith(("accelerometer", "name", "serial")):
        path.write_bytes((HEAD.replace("name: unit\n", "") + text).encode("utf-8", "surrogateescape"))
        assert one_line(typed("apply", path, path).err).startswith(f"{path}: ")


ATOMS = ["1", "a", "[", "]", "{", "}", ",", ": ", "- ", "? ", "&a ", "*a", "!!int ", "!!float ", "!!bool "]
ATOMS += [
    "\n",
    "  ",
    '"',
    "'",
    "|",
    ">",
    "#",
    "%",
    "!",
    "~",
    "<<: ",
    "0x_",
    "1e400",
    ".nan",
    "\\U",
    "\t",
    "---\n",
]
ATOMS += ["schema: ", "tumble-calibration/1", "name: ", "accelerometer: ", "M: ", "b: ", "\0", "é", "\ud800"]


@given(parts=st.lists(st.sampled_from(ATOMS), max_size=60), often=st.integers(1, 2000))
def test_any_text_is_read_or_refused_after_bounded_work(parts, often):
    text = "".join(parts)
    count = 0

    class Counted(bounded_yaml._Loader):
        def compose_node(self, parent, index):
            nonlocal count
            count += 1
            return super().compose_node(parent, index)

    whole = bounded_yaml._Loader
    bounded_yaml._Loader = Counted
    said = ""
    try:
        bounded_yaml.parse(text * often)
    except yaml.YAMLError as error:
        said = bounded_yaml.problem_in_words(error)
    finally:
        bounded_yaml._Loader = whole
    assert len(said) < 300
    assert count <= PART_WORK


@settings(max_examples=50)
@given(
    content=st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
        lambda part: st.lists(part, max_size=4) | st.dictionaries(st.text(max_size=5), part, max_size=4),
    ),
    key=st.sampled_from(["accelerometer", "name", "method", "units", "poses", "collect", "unit"]),
    name=st.sampled_from(sorted(SCHEMAS)),
)
def test_any_content_is_a_document_or_a_mistake_in_one_line(tmp_path_factory, content, key, name):
    path = tmp_path_factory.mktemp("document") / "any.yaml"
    schema = SCHEMAS[name]
    model = schema.load_model()
    path.write_text(yaml.safe_dump({"schema": model.model_fields["schema_"].default, key: content}))
    said = ""
    try:
        documents.read_document(path, model, schema)
    except tumble.TumbleError as error:
        said = str(error)
    assert "\n" not in said
    assert len(said) < 1000


@pytest.mark.parametrize("device", ["/dev/zero", "pipe"])
def test_endless_input_is_refused_unread(tmp_path, device):
    path = tmp_path / device
    if device == "pipe":
        os.mkfifo(path)
    assert "is a device or a pipe" in one_line(typed("apply", path, path).err)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ("collect=1e30", "collect"),
        ("fewest_pairs=99999999999999999999", "fewest_pairs"),
        ("gravity=1e300", "gravity"),
        (f"collect={'9' * 400}", "collect"),
        ("units.a.identity=99999999999999999999", "identity"),
        ("units.a.lever_arm=[1e308, 0, 0]", "lever_arm"),
        (f"units.a.sensor_from_primary=[{'1' * 60}, 0, 0]", "sensor_from_primary"),
        ("specific_force_deviation=1e300", "specific_force_deviation"),
        ("? [1]", "--set"),
    ],
)
def test_a_setting_beyond_what_the_core_keeps_is_one_line(change, key):
    words = ("--primary", "a.csv", "--secondary", "b.csv", "--set", change)
    done = typed("redundancy", *words)
    assert done.code == 2
    assert key in one_line(done.err)


def test_a_calibration_without_its_schema_is_refused(tmp_path):
    path = tmp_path / "unit.yaml"
    path.write_text(f"name: unit\n{ACCELEROMETER}")
    assert "says no schema" in one_line(typed("apply", path, path).err)
    path.write_text(HEAD + ACCELEROMETER)
    assert tumble.Calibration.load(path).name == "unit"


def test_a_document_of_another_kind_is_named_for_what_it_is(tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text("schema: tumble-limits/1\naccelerometer: {bias: 1.0}\n")
    assert "is a limits file, not a calibration file" in one_line(typed("apply", path, path).err)


def test_a_date_in_a_document_is_the_text_that_stands_there(tmp_path):
    path = tmp_path / "unit.yaml"
    path.write_text(HEAD + "serial: 2020-01-31\n" + ACCELEROMETER)
    assert tumble.Calibration.load(path).serial == "2020-01-31"


@pytest.mark.parametrize("name", sorted(SCHEMAS))
def test_every_schema_can_be_printed_without_the_documentation(name):
    import json

    shown = typed("schema", name)
    assert json.loads(shown.out)["$id"].startswith(f"urn:tumble-{name}:")
    assert f"{name}: " in typed("schema").out
    assert "schema" in COMMANDS


def test_a_schema_that_there_is_not_is_refused_with_those_there_are():
    assert "calibration, poses" in one_line(typed("schema", "nothing").err)


@given(
    text=st.one_of(
        st.text(st.sampled_from("0123456789eE.+-_:xob"), min_size=1, max_size=8), st.text(max_size=8)
    ).filter(lambda text: text.isprintable())
)
@example(text="471e25")
@example(text="0042")
def test_text_of_a_document_reads_back_as_it_is(text):
    written = documents.document_text("made up", {"serial": text, text: 1.0})
    assert bounded_yaml.parse(written)[1] == {"serial": text, text: 1.0}


@pytest.mark.parametrize(
    ("written", "read"),
    [("010", 10), ("08", 8), ("+1", 1), ("1e-3", 1e-3), (".5", 0.5), ("5.", 5.0), ("-.inf", -float("inf"))],
)
def test_a_number_of_a_document_is_a_decimal(written, read):
    assert bounded_yaml.parse(written)[1] == read
    assert bounded_yaml.parse(f"!!float '{written}'")[1] == read


@pytest.mark.parametrize("written", ["1:30", "1:30.5", "1_0", "0x11", "0b11", "0o7", "nan", "1e"])
def test_no_other_notation_is_read_as_a_number(written):
    assert bounded_yaml.parse(written)[1] == written
    for kind in ("int", "float"):
        with pytest.raises(yaml.YAMLError, match=f"cannot be read as {kind}"):
            bounded_yaml.parse(f"!!{kind} '{written}'")

"""Documents that commands print with `--json` have a schema and a verdict, and satisfy that schema."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import tumble
from repetitions import SOAK
from tumble.foundation.procedures import PROCEDURES
from tumble.foundation.schemas import EVENTS, PRINTED
from turntable_sessions import typed

SCHEMAS = Path(__file__).parents[2] / "docs" / "schema"
QUICK = {
    "static": "--duration 5min --rate 20",
    "multipose": "--rate 50",
    "thermal": "--duration 20min --rate 10",
    "turntable": "--grades consumer,consumer --rest 4 --rate 50",
    "flight": "--duration 30",
}
"""Options of recordings, so that none is long."""
MADE = dict.fromkeys(row.simulated for row in PROCEDURES)
PRINTS = {
    "formats": "formats",
    "export-formats": "export --format list",
    "settings": "redundancy --explain",
    "diagnosis": "doctor",
    "tables": "table list",
    "table-position": "table position --table simulated:two-axis",
    "inspection": "inspect {0}/static/static.csv nothing.csv",
    "conversion": "convert {0}/static/static.csv -o {0}/static.parquet",
    **{
        f"{row.word}-result": f"{row.word} {row.typed} -o {{0}}".replace("{0}", f"{{0}}/{row.simulated}")
        for row in PROCEDURES
    },
    "compare-result": "compare {0}/multipose/multipose.yaml {0}/turntable/target_1.yaml -o {0}/out",
    "plateaus-result": "plateaus {0}/multipose/multipose.yaml {0}/warmer.yaml {0}/warmest.yaml "
    "--temperature 0 --temperature 20 --temperature 40 -o {0}/out",
    "export": "export {0}/turntable/target_1.yaml --format imucal -o {0}/target_1.json",
    "export-all": "export {0}/turntable/target_1.yaml --all --set rate=100 -o {0}/exported",
    "import": "import {0}/target_1.json -o {0}/imported",
    **{
        f"registry-{name}": f"registry {command} --registry {{0}}/lab.db"
        for name, command in {
            "add": "add {0}/turntable/target_1.yaml --model M1",
            "list": "list",
            "show": "show target_1",
            "history": "history target_1",
            "lot": "history --model M1",
            "due": "due target_1",
            "equipment": "equipment",
            "verify": "verify",
        }.items()
    },
    "certificates": "certificate list --registry {0}/lab.db",
    "fleet-result": "fleet run {0}/job.yaml --workers 1",
    "fleet-status": "fleet status {0}/job.yaml",
    "error": "spin {0}/nothing.csv",
}
"""A command for each document, in an order in which each finds what it needs."""


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Folder of all recordings."""
    return tmp_path_factory.mktemp("documents")


@pytest.fixture(scope="module")
def printed(simulated):
    """Output and exit code of each command."""
    folder = simulated
    found = {}
    for kind in MADE:
        done = typed("simulate", kind, *shlex.split(QUICK.get(kind, "")), "-o", folder / kind, "--json")
        assert done.code == 0, done.err
        found[f"simulation of {kind}"] = done
    assert typed("registry", "init", folder / "lab.db").code == 0
    job = {"procedure": "spin", "inputs": f"{folder}/spin/spin.csv", "results": f"{folder}/fleet"}
    (folder / "job.yaml").write_text(json.dumps(job))
    for name, command in PRINTS.items():
        if name == "plateaus-result":
            _warm(folder)
        found[name] = typed(*shlex.split(command.format(folder)), "--json")
    return found


def _warm(folder):
    """Writes calibrations of the same unit at two more temperatures."""
    cold = tumble.Calibration.load(folder / "multipose/multipose.yaml")
    for name, bias in (("warmer", 1e-3), ("warmest", 2e-3)):
        shifted = cold.accelerometer.model_copy(update={"b": cold.accelerometer.b + bias})
        cold.model_copy(update={"accelerometer": shifted}).save(folder / f"{name}.yaml")


@pytest.mark.parametrize("name", [*PRINTS, *(f"simulation of {kind}" for kind in MADE)])
def test_a_document_is_what_its_schema_says(printed, name):
    document = json.loads(printed[name].out)
    schema = name.partition(" ")[0]
    published = json.loads((SCHEMAS / f"{schema}.schema.json").read_text())
    Draft202012Validator(published).validate(document)
    assert document["schema"] == f"tumble-{schema}/1"
    assert isinstance(document["verdict"], str)


def test_every_document_that_is_printed_is_tried():
    assert set(PRINTED) == {*PRINTS, "simulation"}


@pytest.mark.parametrize("name", PRINTED)
def test_schemas_are_listed_and_printed(name):
    assert typed("schema", name).out == (SCHEMAS / f"{name}.schema.json").read_text()
    assert f"{name}: {PRINTED[name].what}\n" in typed("schema").out


@pytest.mark.parametrize(
    ("words", "kind", "about"),
    [
        (("spin", "nothing.csv", "--json"), "LogError", ""),
        (("spin", "--js"), "ProcedureError", ""),
        (("spin", "--json", "--turns", "x"), "CommandError", ""),
        (("align", "--json"), "CommandError", ""),
        (("inspec", "--json"), "CommandError", ""),
        (("turntable", "--live", "a=udp://:x", "--json"), "LogError", ""),
    ],
)
def test_a_mistake_is_told_in_json_too(words, kind, about):
    done = typed(*words)
    assert done.code == 2
    told = json.loads(done.out.splitlines()[-1])
    assert (told["schema"], told["verdict"]) == ("tumble-error/1", "error")
    assert len(done.out.splitlines()) == 1
    Draft202012Validator(json.loads((SCHEMAS / "error.schema.json").read_text())).validate(told)
    assert told["error"]["kind"] == kind
    assert f"tumble: error: {told['error']['message']}\n" in done.err


@pytest.mark.parametrize("words", [("spin", "nothing.csv"), ("inspect", "--", "--json")])
def test_a_mistake_is_a_line_alone_where_no_json_was_asked_for(words):
    done = typed(*words)
    assert (done.code, done.out) == (2, "")


LIVE = {
    "record-event": "record imu=replay:{0}/spin/spin.csv -o {0}/recorded",
    "spin-event": "spin --live replay:{0}/spin/spin.csv -o {0}/live_spin",
    "multipose-event": "multipose --live replay:{0}/multipose/multipose.csv -o {0}/live_multipose",
    "turntable-event": "turntable --live reference=replay:{0}/turntable/reference.csv "
    "target_1=replay:{0}/turntable/target_1.csv --pose-seconds 3 -o {0}/live_turntable",
    "redundancy-event": "redundancy --live primary=replay:{0}/flight/primary.csv "
    "secondary_1=replay:{0}/flight/secondary_1.csv -o {0}/live_redundancy",
}


@pytest.mark.parametrize("name", EVENTS)
def test_events_of_a_live_session_are_what_their_schema_says(printed, simulated, simulated_clock, name):
    done = typed(*shlex.split(LIVE[name].format(simulated)), "--json")
    *events, last = map(json.loads, done.out.splitlines())
    schema = Draft202012Validator(json.loads((SCHEMAS / f"{name}.schema.json").read_text()))
    assert events
    forms = set()
    for number, event in enumerate(events):
        # Every tenth of hundreds of one form is held against the schema; all of them in `make soak`.
        form = (event["event"], *((key, type(value)) for key, value in event.items()))
        if form in forms and number % 10 and not SOAK:
            continue
        forms.add(form)
        if name == "redundancy-event" and event["event"] == "listening":
            assert event["units"] == ["primary", "secondary_1"]
        else:
            schema.validate(event)
    if name == "record-event":
        schema.validate(last)
    else:
        assert last["schema"] == f"tumble-{name.removesuffix('-event')}-result/1" or last["event"] == "failed"

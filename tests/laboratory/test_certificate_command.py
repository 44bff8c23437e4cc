"""`tumble certificate` as it is typed."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from dcc_schemas import rule_errors, schema_errors
from made_up_calibrations import made_up, save
from made_up_certificates import SETTINGS, options, project_file, with_covariance
from pdf_text import text_of
from tumble.calibration.document import Calibration
from tumble.calibration.limits import Limits
from tumble.laboratory.certificate.dcc_reader import read_dcc
from tumble.laboratory.certificate.signature import attached_xml
from tumble.laboratory.registry import Registry
from turntable_sessions import one_line, typed


@pytest.fixture(autouse=True)
def laboratory(tmp_path, monkeypatch):
    """A folder with a registry, a project file, and results of two units."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "nobody"))
    Registry.create(tmp_path / "lab.db")
    (tmp_path / "tumble.toml").write_text(project_file() + 'registry = "lab.db"\n')
    units = [with_covariance(made_up(serial=serial, log=serial)) for serial in ("0041", "0042")]
    save(tmp_path / "results", *units)


def certified(*words):
    done = typed("certificate", *words)
    assert done.code == 0, done.err
    return done


def refusal(*words):
    done = typed("certificate", *words)
    assert (done.code, done.out) == (2, ""), done
    return one_line(done.err)


def test_results_become_certificates_that_are_valid(tmp_path):
    done = certified("results", "-o", "certificates")
    assert [line.partition(":")[0] for line in done.out.splitlines()] == ["IMU-2026-0001", "IMU-2026-0002"]
    for number in ("IMU-2026-0001", "IMU-2026-0002"):
        xml = (tmp_path / "certificates" / f"{number}.xml").read_bytes()
        assert attached_xml((tmp_path / "certificates" / f"{number}.pdf").read_bytes()) == xml
        assert (schema_errors(xml), rule_errors(xml)) == ([], [])
        found = read_dcc(xml)
        assert (found.number, found.laboratory.name) == (number, SETTINGS["laboratory"])
        assert (found.calibrated[0].operator, found.calibrated[0].day) == ("Ann", "2026-01-05")
    assert typed("registry", "verify").code == 0


def test_the_certificate_says_the_numbers_of_the_result(tmp_path):
    certified("results/result_0.yaml", "-o", "certificates")
    xml = (tmp_path / "certificates" / "IMU-2026-0001.xml").read_bytes()
    quantities = {each.parameter: each for each in read_dcc(xml).calibrated[0].quantities}
    bias = quantities["accelerometer bias y"]
    assert (bias.value, bias.uncertainty, bias.coverage_factor) == ("-0.2000", "0.0020", "1.96")
    calibration = Calibration.load("results/result_0.yaml").accelerometer
    (model,) = read_dcc(xml).calibrated[0].models
    assert (model.M == calibration.M).all()
    assert (model.covariance == calibration.total_covariance).all()


def test_pdf_and_xml_of_a_result_show_the_same_numbers(tmp_path):
    certified("results/result_0.yaml", "-o", "certificates")
    path = tmp_path / "certificates" / "IMU-2026-0001.xml"
    shown = text_of(path.with_suffix(".pdf").read_bytes())
    quantities = read_dcc(path.read_bytes()).calibrated[0].quantities
    assert len(quantities) == 12
    for each in quantities:
        name = each.parameter.partition(" ")[2]
        assert f"{name} {each.value} {each.uncertainty} {each.coverage_factor}" in shown


def test_budget_and_decision_of_the_result_are_shown(tmp_path):
    result = with_covariance(
        made_up(limits=Limits.model_validate({"accelerometer": {"bias": 1.0}}).content())
    )
    budget = {
        "parameter": "bias x", "unit": "m/s^2", "value": 0.1, "combined_uncertainty": 2e-3, "entries": [],
        "degrees_of_freedom": 5.0, "coverage_factor": 2.5706, "expanded_uncertainty": 5.1412e-3,
    }  # fmt: skip
    decision = {
        "rule": "guarded", "guard": 1.0, "verdict": "conditional pass", "probability": 0.97, "parameters": [],
    }  # fmt: skip
    content = result.content() | {"decision": decision}
    content["accelerometer"]["budget"] = [budget]
    save(tmp_path / "judged", Calibration.model_validate(content))
    certified("judged", "-o", "certificates")
    calibrated = read_dcc((tmp_path / "certificates" / "IMU-2026-0001.xml").read_bytes()).calibrated[0]
    (bias,) = [each for each in calibrated.quantities if each.parameter == "accelerometer bias x"]
    assert (bias.value, bias.uncertainty, bias.coverage_factor) == ("0.1000", "0.0051", "2.57")
    assert (calibrated.decision.rule, calibrated.decision.verdict) == ("guarded", "conditional pass")


def test_a_verdict_by_limits_alone_is_the_simple_rule(tmp_path):
    limits = Limits.model_validate({"accelerometer": {"bias": 0.01}}).content()
    save(tmp_path / "judged", made_up(limits=limits, verdict="fail"))
    certified("judged", "-o", "certificates")
    decision = read_dcc((tmp_path / "certificates" / "IMU-2026-0001.xml").read_bytes()).calibrated[0].decision
    assert (decision.rule, decision.verdict) == ("simple", "fail")


def test_as_found_and_as_left_stand_on_one_certificate(tmp_path):
    save(tmp_path / "before", made_up(serial="0041", log="before", bias=(0.5, 0.5, 0.5)))
    certified("results/result_0.yaml", "--as-found", "before", "-o", "certificates")
    found = read_dcc((tmp_path / "certificates" / "IMU-2026-0001.xml").read_bytes())
    assert [each.condition for each in found.calibrated] == ["as found", "as left"]
    assert typed("certificate", "show", "IMU-2026-0001").out.count(", ") == 1


def test_two_results_of_a_unit_without_a_condition_are_refused(tmp_path):
    save(tmp_path / "again", made_up(serial="0041", log="again"))
    assert "--as-found" in refusal("results", "again", "-o", "certificates")
    assert typed("certificate", "list", "--json").out.count("number") == 0


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"operator": ""}, "states no operator"),
        ({"serial": ""}, "states no serial"),
        ({"verdict": "model not met"}, "the model is not met"),
    ],
)
def test_a_result_without_what_a_certificate_needs_has_none(tmp_path, changed, words):
    save(tmp_path / "poor", made_up(**changed))
    message = refusal("poor", "-o", "certificates", "--operator", "Eve")
    assert "no certificate" in message
    assert words in message
    assert not (tmp_path / "certificates").exists()


@pytest.mark.parametrize("words", [(), ("--registry", "")])
def test_a_result_of_the_future_has_no_certificate(tmp_path, words):
    save(tmp_path / "future", made_up(date="2199-01-05T10:00:00Z"))
    number = ("--number", "X-1") if words else ()
    message = refusal("future", "-o", "certificates", *words, *number)
    assert "'2199-01-05T10:00:00Z' is in the future; correct it, or the clock of the computer" in message
    assert not (tmp_path / "certificates").exists()


def test_a_reference_certified_after_the_result_is_refused(tmp_path):
    unit = with_covariance(made_up())
    stated = {
        "laboratory": "Metrology",
        "number": "M-1",
        "date": "2026-03-01",
        "file": "reference.yaml",
        "sha256": "0" * 64,
    }
    content = unit.content()
    content["reference"] = {"name": "reference", "certificate": stated}
    save(tmp_path / "early", Calibration.model_validate(content))
    assert "the certificate of its reference of 2026-03-01, after it" in refusal(
        "early", "-o", "certificates"
    )


def test_a_result_has_a_certificate_once_it_states_its_operator(tmp_path):
    save(tmp_path / "poor", made_up(serial="77", operator=""))
    assert "calibrate again with --operator NAME" in refusal("poor", "-o", "certificates")
    save(tmp_path / "poor", made_up(serial="77", operator="Ann"))
    certified("poor", "-o", "certificates")
    assert (tmp_path / "certificates" / "IMU-2026-0001.xml").exists()


def test_a_result_on_record_without_operator_stays_without(tmp_path):
    save(tmp_path / "poor", made_up(serial="77", operator=""))
    assert typed("registry", "add", "poor").code == 0
    save(tmp_path / "poor", made_up(serial="77", operator="Ann"))
    assert "calibrate a new recording with --operator NAME" in refusal("poor", "-o", "certificates")


def test_a_result_of_noise_alone_has_no_certificate(tmp_path):
    content = made_up().content()
    triad = {key: content["accelerometer"][key] for key in ("unit", "M", "b")}
    content["accelerometer"] = triad | {"noise_density": [1e-3] * 3}
    content["method"]["procedure"] = "noise"
    save(tmp_path / "noise", Calibration.model_validate(content))
    assert "no value with an uncertainty" in refusal("noise")


def test_all_runs_that_gave_a_part_are_stated(tmp_path):
    content = made_up().content()
    content["contributions"] = [
        {
            "gave": ["accelerometer noise"],
            "method": {"procedure": "noise"},
            "software": "tumble 0.1.0",
            "date": "2026-03-01T10:00:00Z",
            "operator": "Bob",
        }
    ]
    content["accelerometer"]["noise_density"] = [1e-3] * 3
    save(tmp_path / "both", Calibration.model_validate(content))
    certified("both", "-o", "certificates")
    calibrated = read_dcc((tmp_path / "certificates" / "IMU-2026-0001.xml").read_bytes()).calibrated[0]
    assert calibrated.procedures == ("turntable", "noise")
    assert calibrated.operator == "Ann, Bob"
    assert (calibrated.begun, calibrated.day) == ("2026-01-05", "2026-03-01")


@pytest.mark.parametrize("name", ["address", "country", "customer", "customer_address", "authorised_by"])
def test_a_laboratory_that_states_too_little_is_told(tmp_path, name):
    (tmp_path / "tumble.toml").write_text(project_file(**{name: "x"}).replace(f"{name} = 'x'\n", "", 1))
    message = refusal("results", "--registry", "lab.db")
    assert f"--{name.replace('_', '-')}" in message


def test_a_unit_from_the_registry_is_named_by_its_serial(tmp_path):
    typed("registry", "add", "results", "--owner", "Owner Ltd", "--model", "M1")
    (tmp_path / "tumble.toml").write_text(
        project_file().replace("customer = 'Acme Robotics'\n", "") + 'registry = "lab.db"\n'
    )
    certified("0042", "-o", "certificates")
    found = read_dcc((tmp_path / "certificates" / "IMU-2026-0001.xml").read_bytes())
    assert (found.item.serial, found.item.model, found.customer.name) == ("0042", "M1", "Owner Ltd")


def test_without_a_registry_the_number_is_given(tmp_path):
    (tmp_path / "tumble.toml").unlink()
    words = options(certificate_number="")
    assert "--number" in refusal("results/result_0.yaml", *words)
    certified("results/result_0.yaml", *words, "--number", "K/1", "-o", "certificates")
    assert read_dcc((tmp_path / "certificates" / "K_1.xml").read_bytes()).number == "K/1"
    assert "2 units" in refusal("results", *words, "--number", "K/2")


def test_a_certified_result_is_certified_again_only_in_its_place():
    certified("results", "-o", "certificates")
    assert "--supersedes IMU-2026-0001" in refusal("results/result_0.yaml")
    certified("0041", "--supersedes", "IMU-2026-0001", "--remark", "Name corrected", "-o", "certificates")
    found = read_dcc(Path("certificates/IMU-2026-0003.xml").read_bytes())
    assert (found.supersedes, found.remarks) == ("IMU-2026-0001", ("Name corrected",))
    listed = json.loads(typed("certificate", "list", "--json").out)
    assert [row["state"] for row in listed["certificates"]] == [
        "superseded by IMU-2026-0003",
        "issued",
        "issued",
    ]


def test_a_folder_that_is_certified_in_part_is_given_again():
    certified("results/result_0.yaml")
    done = certified("results", "-o", "certificates")
    assert done.out.startswith("IMU-2026-0002: serial 0042")
    assert "1 unit with a certificate that holds: left out" in done.err


def test_a_certificate_is_signed_verified_and_withdrawn(tmp_path):
    certified("key", "lab.pem", "--laboratory", "Inertial laboratory")
    certified("results", "-o", "certificates")
    done = certified("sign", "IMU-2026-0001", "--signing-key", "lab.pem", "-o", "certificates")
    assert "signed" in done.out
    files = ("certificates/IMU-2026-0001.pdf", "certificates/IMU-2026-0001.xml")
    done = certified("verify", *files, "--signer", "lab.crt")
    assert done.out.count("unchanged since Inertial laboratory signed it, issued") == 2
    content = bytearray((tmp_path / files[0]).read_bytes())
    content[5000] ^= 4
    (tmp_path / "changed.pdf").write_bytes(content)
    assert typed("certificate", "verify", "changed.pdf", "--signer", "lab.crt").code == 3
    certified("withdraw", "IMU-2026-0001", "--why", "wrong customer")
    done = typed("certificate", "verify", *files, "--signer", "lab.crt", "--json")
    assert done.code == 3
    checks = json.loads(done.out)["checks"]
    assert [(each["holds"], each["state"]) for each in checks] == [(False, "withdrawn")] * 2
    assert "is withdrawn" in refusal("sign", "IMU-2026-0001", "--signing-key", "lab.pem")
    assert typed("registry", "verify").code == 0


def test_with_a_key_certificates_are_signed_when_issued(tmp_path):
    certified("key", "lab.pem", "--laboratory", "Inertial laboratory")
    certified("results/result_0.yaml", "--signing-key", "lab.pem", "-o", "certificates")
    pdf, xml = "certificates/IMU-2026-0001.pdf", "certificates/IMU-2026-0001.xml"
    certified("verify", pdf, xml, "--signer", "lab.crt")
    content = (tmp_path / xml).read_bytes()
    assert attached_xml((tmp_path / pdf).read_bytes()) == content
    assert (schema_errors(content), rule_errors(content)) == ([], [])


def test_files_of_a_certificate_come_back_from_the_registry(tmp_path):
    certified("results/result_0.yaml", "-o", "first")
    certified("show", "IMU-2026-0001", "-o", "second")
    for ending in ("pdf", "xml"):
        name = f"IMU-2026-0001.{ending}"
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes()


def test_the_template_that_is_printed_is_taken_back(tmp_path):
    (tmp_path / "ours.typ").write_text(certified("template").out)
    certified("results/result_0.yaml", "--template", "ours.typ", "-o", "certificates")


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("absent",), "no result of the registry begins like that"),
        (("results", "--certificate-number", "{serial}"), "pattern"),
        (("results", "--language", "de"), "en or en,zh"),
        (("results", "--country", "Germany"), "country"),
        (("results", "--logo", "absent.svg"), "absent.svg"),
        (("results", "--signing-key", "absent.pem"), "absent.pem"),
        (("results", "--template", "absent.typ"), "absent.typ"),
        (("results", "--template", "absent/absent.typ"), "absent/absent.typ: cannot be read"),
        (("results", "--number", "1"), "the registry counts"),
        (("withdraw", "IMU-1"), "--why"),
        (("withdraw", "IMU-1", "--why", "x"), "none of that number"),
        (("show", "IMU-1"), "none of that number"),
        (("sign", "IMU-1"), "no key is set"),
        (("verify", "absent.pdf"), "no signer is known"),
        (("key", "lab.pem", "--laboratory", "", "--debug-not"), "no such option"),
    ],
)
def test_a_mistake_is_one_line(words, part):
    assert part in refusal(*words).lower() if part.islower() else part in refusal(*words)


def test_a_missing_library_is_named_with_how_to_get_it(monkeypatch):
    for name in [name for name in sys.modules if name.startswith("tumble.laboratory.certificate")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "typst", None)
    message = refusal("results")
    assert "a certificate needs the Python package typst" in message
    assert "'tumble-imu[laboratory]'" in message

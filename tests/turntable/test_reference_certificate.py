"""A reference with a certificate: budgets of its targets, and what the command makes of it."""

import json
import sqlite3

import numpy as np
import pytest
import yaml

import certified_references as certified
import tumble
from tumble import Calibration, Recording
from tumble.foundation.error_decomposition import factors, mounting_angles, non_orthogonality
from tumble.foundation.errors import CalibrationFileError, ProcedureError
from tumble.tools.simulate import write_turntable
from turntable_sessions import calibrate, refusal, simulate, typed

DRAWS = 10_000
AGREE = 0.05
"""Largest difference of Monte Carlo and budget (issue 30)."""
GRAVITY, GRAVITY_SIGMA = 9.80665, 5e-4
COMMAND = ("--gravity", GRAVITY, "--gravity-uncertainty", GRAVITY_SIGMA)


def budgeted(session, **options):
    stated = {"gravity": GRAVITY, "gravity_uncertainty": GRAVITY_SIGMA, **options}
    return calibrate(session, **{"reference_certificate": certified.certificate(), **stated})[0]


def contributions(budget, word):
    found = [each.contribution for each in budget.entries if word in each.source]
    assert found, [each.source for each in budget.entries]
    return float(np.hypot.reduce(found))


def read_off(matrix, bias):
    """(12,) parameters as printed."""
    angles = np.degrees(non_orthogonality(matrix))
    turn = mounting_angles(factors(matrix)[2])
    return np.concatenate([bias, np.linalg.norm(matrix, axis=1), angles, turn])


@pytest.fixture(scope="module")
def session():
    return simulate(3001, grades=("industrial",))


def test_monte_carlo_agrees_with_the_budget_of_a_gyroscope(session):
    """10,000 references are drawn by the distributions stated, and go through M (I + E)^-1.

    The budget is linear, the draws are not: they take the whole formula of the response.
    """
    found = budgeted(session)
    random = np.random.default_rng(3001)
    budgets, gyroscope = found.budgets["gyroscope"], found.gyroscope
    U = certified.U["gyroscope"]
    years, kelvin = 183 / 365.25, 2.0
    drawn = {}
    for group, size in U.items():
        rectangles = [0.5 * size * years] + [0.1 * size * kelvin] * (group in ("bias", "scale"))
        drawn[group] = random.normal(0.0, 0.5 * size, (DRAWS, 3))
        for half in rectangles:
            drawn[group] += random.uniform(-half, half, (DRAWS, 3))
    values = np.empty((DRAWS, 12))
    for k in range(DRAWS):
        K = np.diag(1.0 + drawn["scale"][k])
        L = certified.lower_triangular(np.radians(drawn["non-orthogonality"][k]))
        corrected = K @ L @ certified.turned(np.radians(drawn["mounting"][k]))  # I + E
        values[k] = read_off(gyroscope.M @ np.linalg.inv(corrected), gyroscope.b)
    sigma = np.array([each.entries[0].contribution for each in budgets])
    freedom = budgets[0].entries[0].degrees_of_freedom
    own = sigma * random.standard_t(freedom or 1e9, (DRAWS, 12))
    for k, budget in enumerate(budgets):
        if budget.parameter.startswith("bias"):
            continue  # The procedure finds the bias of the reference anew, so that none of its error is left.
        drawn_sigma = np.hypot(values[:, k].std(), sigma[k])
        assert budget.combined_uncertainty == pytest.approx(drawn_sigma, rel=AGREE), budget.parameter
        spread = values[:, k] - values[:, k].mean() + own[:, k]
        assert budget.expanded_uncertainty == pytest.approx(np.quantile(np.abs(spread), 0.95), rel=AGREE)


def test_contributions_are_those_of_the_procedure_run_anew(session):
    """Each number of the certificate is deviated by a share of its u, and the whole procedure is run with it.

    A small share keeps the reference as near to the sphere of gravity as it is, on which its weight depends.
    """
    step, base = 0.02, budgeted(session)
    before = {triad: read_off(getattr(base, triad).M, getattr(base, triad).b) for triad in certified.U}
    squares = {triad: np.zeros(12) for triad in certified.U}
    for triad, sizes in certified.U.items():
        for group, size in sizes.items():
            for axis in range(3):
                content = certified.content()
                value = np.full(3, certified.IDEAL[group])
                value[axis] += step * 0.5 * size
                content[triad][group]["value"] = value.tolist()
                # Weights follow from what is stated, so that the certificate states the same.
                changed = certified.ReferenceCertificate.model_validate(content)
                moved = getattr(budgeted(session, reference_certificate=changed), triad)
                squares[triad] += ((read_off(moved.M, moved.b) - before[triad]) / step) ** 2
    for triad, found in squares.items():
        for budget, square in zip(base.budgets[triad], found, strict=True):
            stated = contributions(budget, "calibration")
            if stated > 0.02 * budget.combined_uncertainty:
                assert stated == pytest.approx(np.sqrt(square), rel=AGREE), (triad, budget.parameter)


def test_interval_and_sigma_of_a_parameter_are_those_of_its_budget(session):
    found = budgeted(session)
    for triad in ("accelerometer", "gyroscope"):
        parameters = {each.name: each for each in getattr(found, triad).parameters}
        for budget in found.budgets[triad]:
            parameter = parameters[budget.parameter]
            assert parameter.sigma == budget.combined_uncertainty
            assert parameter.high - parameter.value == pytest.approx(budget.expanded_uncertainty)
            common = [each.contribution for each in budget.entries if each.common]
            assert parameter.inherited == pytest.approx(np.hypot.reduce(common))


def test_common_part_is_kept_apart_from_the_covariance(session):
    sharp = {triad: {**certified.content()[triad]} for triad in certified.U}
    for triad, section in sharp.items():
        for group, size in certified.U[triad].items():
            section[group] = {"value": [certified.IDEAL[group]] * 3, "U": 1e-3 * size}
    one, other = budgeted(session), budgeted(session, reference_certificate=certified.certificate(**sharp))
    assert np.allclose(one.gyroscope.covariance, other.gyroscope.covariance)
    assert np.diag(one.gyroscope.inherited)[0] > 3.0 * np.diag(other.gyroscope.inherited)[0]


@pytest.mark.parametrize(("step", "spread"), [(2e-2, True), (2e-4, False)], ids=["coarse", "fine"])
def test_resolution_counts_where_noise_does_not_spread_it(step, spread):
    """Noise of a tenth of a step leaves most of q / sqrt(12), that of ten steps leaves nothing."""
    session = simulate(3002, grades=("reference",), quantisation=False)
    samples = session.target_units[0].samples
    forces = step * np.round(samples.accelerometer / step)
    target = Recording.from_arrays("target", samples.time, forces, samples.gyroscope)
    found = tumble.turntable(
        session.reference, [target], reference_certificate=certified.certificate(), gravity=GRAVITY
    )[0]
    entries = [
        each
        for budget in found.budgets["accelerometer"]
        for each in budget.entries
        if each.source == "resolution"
    ]
    if spread:
        assert len(entries) == 12
        assert 0.4 < entries[0].standard_uncertainty / (step / np.sqrt(12.0)) <= 1.0
        rests = sum(rest.used for rest in found.rests)
        balanced = entries[0].standard_uncertainty / np.sqrt(rests)
        assert balanced <= entries[0].contribution <= 1.5 * balanced
    else:
        assert not entries


def test_a_certificate_and_a_calibration_are_not_both_taken(session):
    applied = certified.certificate().calibration()
    with pytest.raises(ProcedureError, match="give one of them"):
        budgeted(session, reference_calibration=applied)


def test_another_serial_than_that_of_the_log_is_refused(session):
    stated = certified.certificate(reference={"serial": "elsewhere"})
    with pytest.raises(CalibrationFileError, match="is of serial"):
        budgeted(session, reference_certificate=stated)


LIMITS = """\
schema: tumble-limits/1
accelerometer: {bias: 10, scale: 0.5}
gyroscope: {scale: 0.5}
decision: {rule: guarded}
"""


@pytest.fixture
def files(session, tmp_path):
    """Logs, certificate and limits, as a laboratory has them."""
    write_turntable(session, tmp_path)
    certified.written(tmp_path / "reference.yaml")
    (tmp_path / "limits.yaml").write_text(LIMITS)
    return tmp_path


def command(files, *more, output="results"):
    logs = files / "reference.csv", files / "target_1.csv"
    certificate = ("--reference-certificate", files / "reference.yaml")
    return (*logs, *certificate, *COMMAND, "-o", files / output, *more)


def limited(files, triad, group, value):
    (files / "limits.yaml").write_text(
        yaml.safe_dump(
            {
                "schema": "tumble-limits/1",
                triad: {group: value},
                "decision": {"rule": "guarded", "guard": 1.0},
            }
        )
    )
    return files / "limits.yaml"


def test_the_command_puts_budget_and_decision_into_every_form(files):
    done = typed("turntable", *command(files, "--limits", files / "limits.yaml", "--json"))
    assert done.code == 0, done.err
    printed = json.loads(done.out)
    assert printed["verdict"] == "pass"
    assert printed["reference"]["certificate"]["number"] == "2026-017"
    saved = Calibration.load(files / "results" / "target_1.yaml")
    assert printed["targets"][0]["calibration"] == saved.content()
    assert saved.verdict == saved.decision.verdict == "pass"
    assert saved.reference.certificate.file == "reference.yaml"
    assert len(saved.accelerometer.budget) == len(saved.gyroscope.budget) == 12
    assert printed["targets"][0]["probability"] == saved.decision.probability > 0.99
    assert "probability of conformity" in (files / "results" / "summary.csv").read_text()
    page = (files / "results" / "target_1.html").read_text()
    for words in ("Budget of the uncertainty", "Guarded rule", "probability of conformity", "2026-017"):
        assert words in page


def furthest(files):
    """Largest deviation of scale of the gyroscope, and its U."""
    typed("turntable", *command(files, output="before"))
    found = Calibration.load(files / "before" / "target_1.yaml").gyroscope.budget
    scales = [each for each in found if each.parameter.startswith("scale")]
    worst = max(scales, key=lambda each: abs(each.value - 1.0))
    return abs(worst.value - 1.0), worst.expanded_uncertainty


@pytest.mark.parametrize(
    ("over", "verdict", "code"),
    [(3.0, "pass", 0), (0.5, "conditional pass", 0), (-0.5, "conditional fail", 3), (-3.0, "fail", 3)],
)
def test_each_verdict_has_its_exit_code_and_its_words(files, over, verdict, code):
    deviation, U = furthest(files)
    limits = limited(files, "gyroscope", "scale", max(deviation + over * U, 1e-9))
    done = typed("turntable", *command(files, "--limits", limits))
    assert done.code == code, done.out + done.err
    assert f"target_1: {verdict.capitalize()}" in done.text
    assert "Probability of conformity of the least sure parameter: target_1" in done.text
    saved = Calibration.load(files / "results" / "target_1.yaml")
    assert saved.verdict == saved.decision.verdict == verdict
    if verdict.startswith("conditional"):
        assert "by less than the guard band" in done.text


def test_the_registry_keeps_rule_and_verdict(files):
    deviation, U = furthest(files)
    limits = limited(files, "gyroscope", "scale", deviation + 0.5 * U)
    registry = files / "registry.db"
    assert typed("registry", "init", registry).code == 0
    done = typed("turntable", *command(files, "--limits", limits, "--registry", registry))
    assert done.code == 0, done.err
    with sqlite3.connect(registry) as connection:
        found = connection.execute("select rule, verdict, why from decision").fetchall()
    assert [row[:2] for row in found] == [("guarded, guard band 1 U", "conditional pass")]
    assert "by less than the guard band" in found[0][2]


def test_a_rule_may_come_from_the_option_where_limits_have_none(files):
    (files / "limits.yaml").write_text("schema: tumble-limits/1\naccelerometer: {bias: 10}\n")
    with_limits = ("--limits", files / "limits.yaml")
    typed("turntable", *command(files, *with_limits))
    assert Calibration.load(files / "results" / "target_1.yaml").decision is None
    typed("turntable", *command(files, *with_limits, "--decision", "guarded:0.5", output="guarded"))
    assert Calibration.load(files / "guarded" / "target_1.yaml").decision.guard == 0.5


REFUSED = {
    "out of date": ({"due": certified.day(-1)}, (), "is out of date since"),
    "another model": ({}, ("--reference-model", "R-10"), "is of model 'R-9', and the reference is a 'R-10'"),
    "a calibration too": ({}, ("--reference-calibration", "other.yaml"), "give one of them"),
    "no such grade": ({}, ("--target-grade", "best"), "target grade 'best': give one of"),
    "no such rule": ({}, ("--limits", "limits.yaml", "--decision", "strict"), "give simple, guarded"),
}


@pytest.mark.parametrize(("changes", "options", "said"), REFUSED.values(), ids=REFUSED)
def test_the_command_refuses_in_one_line_and_writes_nothing(files, changes, options, said):
    certified.written(files / "reference.yaml", **changes)
    assert said in refusal(*command(files, *options)).replace('"', "'")
    assert not (files / "results").exists()


@pytest.mark.parametrize(
    ("changes", "said"),
    [({"due": certified.day(-1)}, "out of date"), ({}, "is of model")],
    ids=["old", "model"],
)
def test_a_live_session_is_refused_before_it_records(files, changes, said):
    certified.written(files / "reference.yaml", **changes)
    sources = "reference=udp://127.0.0.1:9", "target_1=udp://127.0.0.1:9"
    options = (
        "--reference-certificate",
        files / "reference.yaml",
        "--reference-model",
        "R-10" if not changes else "R-9",
    )
    assert said in refusal("--live", *sources, *options, "-o", files / "live")
    assert not (files / "live").exists()


def test_limits_of_the_project_file_apply(files, monkeypatch):
    (files / "tumble.toml").write_text('limits = "limits.yaml"\n')
    monkeypatch.chdir(files)
    done = typed("turntable", "reference.csv", "target_1.csv", "-o", "results")
    assert done.code == 0, done.err
    assert Calibration.load("results/target_1.yaml").verdict == "pass"


def test_a_project_may_state_the_certificate_once(files, monkeypatch):
    (files / "tumble.toml").write_text('reference_certificate = "reference.yaml"\n')
    monkeypatch.chdir(files)
    done = typed("turntable", "reference.csv", "target_1.csv", *COMMAND, "-o", "results")
    assert done.code == 0, done.err
    assert Calibration.load("results/target_1.yaml").reference.certificate.number == "2026-017"

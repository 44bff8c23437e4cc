"""Statements of the documents hold: links lead somewhere, options exist, messages and figures are ours."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from theory_formulas import mean_log
from tumble.calibration.limits import Limits
from tumble.calibration.reference_certificate import read_reference_certificate
from tumble.logs.columns import recognise
from tumble.poses.pose_list import SIX_FACES, PoseFile
from tumble.tools.simulate import Grade

ROOT = Path(__file__).parents[2]
DOCUMENTS = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "benchmarks/README.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
]
REFUSING = [
    page
    for page in sorted((ROOT / "docs" / "how-to").glob("*.md"))
    if "\n## When it refuses" in page.read_text(encoding="utf-8")
]
TURNTABLE = ROOT / "docs" / "how-to" / "turntable.md"
READ_LOGS = ROOT / "docs" / "how-to" / "read-logs.md"
GRADES = ("consumer", "industrial", "tactical")
GRAVITY = 9.80665
TURNING = 3.0


def text_of(document):
    return document.read_text(encoding="utf-8")


def anchors(document):
    """Returns what may follow a # in a link to the document, as GitHub makes it from a heading."""
    headings = re.findall(r"^#+ (.*)$", text_of(document), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def named(path):
    return str(path.relative_to(ROOT))


def prose_of(document):
    """A page without its blocks of code, whose brackets are no links."""
    return re.sub(r"^```.*?^```$", "", text_of(document), flags=re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def sources():
    """All code of the package, in which strings that are written over several lines are one."""
    code = "\n".join(text_of(path) for path in sorted((ROOT / "python" / "tumble").rglob("*.py")))
    return re.sub(r"\"\s*\n\s*f?\"", "", code)


@pytest.mark.parametrize("page", REFUSING, ids=named)
def test_messages_that_a_how_to_explains_are_those_of_the_program(page, sources):
    section = text_of(page).split("\n## When it refuses")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (`.*?) \|", section, re.MULTILINE)
    messages = [message for row in rows for message in re.findall(r"`([^`]+)`", row)]
    assert len(messages) >= 9
    # Messages have figures and names in braces.
    varies = r"\d[\d.]*|\.\.\.|'[^']*'"
    pieces = [piece.strip(" ,:;") for message in messages for piece in re.split(varies, message)]
    assert [piece for piece in pieces if len(piece) > 3 and piece not in sources] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=named)
def test_every_link_within_the_repository_leads_to_a_file(document):
    links = re.findall(r"\]\((?!https?://|mailto:)([^)#]+)", prose_of(document))
    missing = [link for link in links if not (document.parent / link).exists()]
    assert missing == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=named)
def test_every_link_to_a_heading_leads_to_one(document):
    links = re.findall(r"\]\((?!https?://|mailto:)([^)#]*)#([^)]+)", text_of(document))
    missing = [
        f"{page}#{anchor}"
        for page, anchor in links
        if anchor not in anchors(document.parent / page if page else document)
    ]
    assert missing == []


def defined_types(folder, pattern, suffix):
    return [
        name
        for path in (ROOT / folder).rglob(f"*{suffix}")
        for name in re.findall(pattern, text_of(path), re.M)
    ]


def test_every_type_of_the_glossary_is_defined_once():
    table = text_of(ROOT / "docs" / "glossary.md").split("| type | is |")[1]
    names = re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)
    assert len(names) > 20
    rust = [
        name
        for crate in ("core", "store", "lab")
        for name in defined_types(
            f"crates/tumble-{crate}/src", r"^\s*pub(?:\(\w+\))? (?:struct|enum|trait) (\w+)", ".rs"
        )
    ]
    python = defined_types("python/tumble", r"^class (\w+)", ".py")
    wrong = [name for name in names if max(rust.count(name), python.count(name)) != 1]
    assert wrong == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=named)
def test_equations_are_numbered_in_order(document):
    numbers = [int(number) for number in re.findall(r"\\tag\{(\d+)\}", text_of(document))]
    assert numbers == list(range(1, len(numbers) + 1))


def cited_equations(source):
    """(page, number) of every equation that a file cites.

    A statement that computes one ends with `// eq. 8`, of the page that its file names first, or
    `// noise.md, eq. 8` of another.
    """
    text = text_of(source)
    in_full = re.findall(r"docs/theory/(\w+\.md), eq\. ([\d to,]+)", text)
    page = next(iter(re.findall(r"docs/theory/(\w+\.md)", text)), "no page named")
    tags = re.findall(r"(?<![/!])// (?:(\w+\.md), )?eq\. ([\d to,]+)", text)
    cited = [*in_full, *((named or page, numbers) for named, numbers in tags)]
    return [(name, int(number)) for name, numbers in cited for number in re.findall(r"\d+", numbers)]


def test_equations_that_the_code_cites_exist():
    sources = [*(ROOT / "crates").rglob("*.rs"), *(ROOT / "python").rglob("*.py")]
    cited = {equation for source in sources for equation in cited_equations(source)}
    assert cited
    tags = {
        (page.name, int(number))
        for page in (ROOT / "docs" / "theory").glob("*.md")
        for number in re.findall(r"\\tag\{(\d+)\}", text_of(page))
    }
    assert cited - tags == set()


def test_turntable_messages_in_the_how_to_are_those_of_the_program():
    section = text_of(TURNTABLE).split("## When it refuses")[1]
    quoted = [
        fragment
        for row in re.findall(r"^\| (`.*?) \|", section, re.MULTILINE)
        for message in re.findall(r"`([^`]+)`", row)
        for fragment in re.split(r"\.\.\.|\bN\b|'[^']*'|\d[\d.]*", message)
        if len(fragment.strip()) > 3
    ]
    sources = (text_of(path) for path in (ROOT / "python" / "tumble").rglob("*.py"))
    # Messages are written over several lines, and with figures in braces.
    told = re.sub(r"\"\s*\n\s*f?\"", "", "\n".join(sources))
    told = re.sub(r"\{count_of\('([a-z ]+)', [^}]*\)\}", r"{} \1s", told)
    missing = [fragment for fragment in quoted if fragment.strip(" ,") not in told]
    assert missing == []


def test_column_names_of_the_how_to_are_recognised():
    section = text_of(READ_LOGS).split("## Columns of a table")[1].split("## Units")[0]
    quantity = r"^\| (specific force|angular rate|time|temperature) \|(.*?)\|(.*)\|$"
    rows = re.findall(quantity, section, re.MULTILINE)
    quantities = {"specific force": "accelerometer", "angular rate": "gyroscope"}
    assert len(rows) == 4
    for quantity, words, examples in rows:
        wanted = quantities.get(quantity, quantity)
        suffix = "_x" if quantity in quantities else ""
        for word in re.findall(r"`(\w*[a-z]\w*)`", words):
            if not word.endswith("_"):
                assert recognise(word + suffix).quantity == wanted, word
        for example in re.findall(r"`([^`]*[_([][^`]*)`", examples):
            assert recognise(example).quantity == wanted, example


def test_files_shown_in_the_turntable_how_to_keep_to_their_schemas(tmp_path):
    certificate, poses, limits = re.findall(r"```yaml\n(.*?)```", text_of(TURNTABLE), re.DOTALL)
    assert len(PoseFile.model_validate(yaml.safe_load(poses)).poses) == 4
    reference = tmp_path / "reference.yaml"
    reference.write_text(certificate)
    assert read_reference_certificate(reference).certificate.triads().keys() == {"accelerometer", "gyroscope"}
    file = tmp_path / "limits.yaml"
    file.write_text(limits)
    assert Limits.load(file).accelerometer.scale.x == 0.02
    assert Limits.load(file).decision.rule == "guarded"


def covariance(noise_density, bias_instability, rest):
    """Equation 4 of docs/theory/noise.md, for six rests in a row."""
    starts = (rest + TURNING) * np.arange(6)
    rests = [(start, start + rest) for start in starts]
    session = (rests[0][0], rests[-1][1])
    of_session = np.array([mean_log(a, session) for a in rests])
    between = np.array([[mean_log(a, b) for b in rests] for a in rests])
    centred = between - of_session[:, None] - of_session + mean_log(session, session)
    return noise_density**2 / rest * np.eye(6) - bias_instability**2 / np.pi * centred


def sigmas(grade, rest):
    """Bias in mm/s^2, scale in ppm, non-orthogonality in mdeg: root mean square over the axes."""
    triad = Grade.named(grade).accelerometer
    noise = covariance(triad.noise_density, triad.bias_instability, rest)
    design = np.hstack([GRAVITY * SIX_FACES.directions(), np.ones((6, 1))])
    variance = np.diag(np.linalg.inv(design.T @ np.linalg.solve(noise, design)))
    element = variance[:3].mean()
    return [1e3 * np.sqrt(variance[3]), 1e6 * np.sqrt(element), 1e3 * np.degrees(np.sqrt(2 * element))]


def test_gain_of_longer_rests_follows_the_noise():
    rows = re.findall(r"^\| (\d+) s \|(.*)\|$", text_of(TURNTABLE), re.MULTILINE)
    assert len(rows) >= 5
    for rest, cells in rows:
        printed = [float(cell) for cell in cells.split("|")]
        expected = [value for grade in GRADES for value in sigmas(grade, float(rest))]
        assert printed == pytest.approx(expected, rel=0.06), f"{rest} s"

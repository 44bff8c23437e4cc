"""Set the formulas of the documentation site as MathML, which browsers draw without a script from elsewhere.

A hook of mkdocs, named in `mkdocs.yml`. A numbered equation can be linked to: `theory/model.html#eq-8`.
"""

from __future__ import annotations

import html
import re

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.pages import Page

FORMULA = re.compile(r'<(span|div) class="arithmatex">(.*?)</\1>', re.DOTALL)
"""Formula as `pymdownx.arithmatex` leaves it: TeX between \\( and \\), or \\[ and \\]."""
CODE = re.compile(r"<(pre|code)\b.*?</\1>", re.DOTALL)
NUMBER = re.compile(r"\s*\\tag\{(\w+)\}")
UNKNOWN_WORD = re.compile(r"<m[io]>(\\[A-Za-z]+)")

SPELLINGS = {
    r"\arg\min": r"\operatorname{arg}\min",
    "{aligned}": "{align*}",
}
"""TeX commands that the converter lacks, and equivalent ones."""

MENDINGS = (
    # Two signs that are one: +=, -= and :=.
    (re.compile(r"<mo><mrow><mo>([^<]+)</mo></mrow></mo><mo>&#x0003D;</mo>"), r"<mo>\1=</mo>"),
    (re.compile(r"<m[io]>(?::|&#x0003A;)</m[io]><mo>&#x0003D;</mo>"), "<mo>:=</mo>"),
    (re.compile(r"<mover>"), '<mover accent="true">'),
    # A bar takes the spaces of a relation unless it is marked as a bracket.
    (
        re.compile(r"<mo(?: stretchy=\"false\")?>(&#x0007C;|&#x02016;)"),
        r'<mo lspace="0" rspace="0" stretchy="false">\1',
    ),
)
"""Output of the converter, and its form for browsers."""


def on_page_content(page_html: str, page: Page, **_: object) -> str:
    """Replaces the formulas of a page, once mkdocs has made HTML of it."""
    page_html = FORMULA.sub(lambda found: formula(html.unescape(found[2]), found[1] == "div"), page_html)
    text = CODE.sub("", page_html)
    left = re.search(r"\$\$|\\tag", text)
    if left:
        # Such as one that is indented by less than four blanks in a list.
        raise PluginError(f"{page.file.src_uri}: a formula is not seen: {text[left.start() :][:80]}")
    return page_html


def formula(tex: str, displayed: bool) -> str:
    """MathML of a formula with its brackets; a displayed one bears its number. ValueError: not understood."""
    body = tex.strip()[2:-2]
    numbers = NUMBER.findall(body)
    body = NUMBER.sub("", body)
    for word, spelling in SPELLINGS.items():
        body = body.replace(word, spelling)
    mathml = convert(body, display="block" if displayed else "inline")
    for written, needed in MENDINGS:
        mathml = written.sub(needed, mathml)
    unknown = UNKNOWN_WORD.search(mathml)
    if unknown:
        raise ValueError(f"{unknown[1]} is not understood in the formula {body}")
    if not displayed:
        return mathml
    label = "".join(f'<a class="equation-number" href="#eq-{n}">({n})</a>' for n in numbers)
    place = "".join(f' id="eq-{n}"' for n in numbers[:1])
    return f'<div class="equation"{place}>{mathml}{label}</div>'

"""The documentation site: formulas are set, links lead somewhere, and nothing is fetched to read it."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import pytest
import typer
from mkdocs.commands.build import build
from mkdocs.config import load_config
from mkdocs.exceptions import Abort

import tumble
from tumble.cli.commands import COMMANDS, command_line

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
THEORY = sorted((DOCS / "theory").glob("*.md"))


def hook(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def small_site(folder, page, **settings):
    """Builds one page with the settings of `mkdocs.yml`, and returns it as HTML."""
    docs = folder / "docs"
    docs.mkdir()
    (docs / "index.md").write_text(page, encoding="utf-8")
    settings = {"nav": ["index.md"], "hooks": [], "extra_css": [], **settings}
    config = load_config(
        str(ROOT / "mkdocs.yml"),
        docs_dir=str(docs),
        site_dir=str(folder / "site"),
        strict=True,
        plugins=["search", "offline"],
        **settings,
    )
    build(config)
    return (folder / "site" / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("link", ["gone.md", "#gone", "/index.md", "../README.md"])
def test_a_link_that_leads_nowhere_ends_the_build(tmp_path, link):
    with pytest.raises(Abort, match="with 1 warnings"):
        small_site(tmp_path, f"# Page\n\n[there]({link})\n")


def test_a_page_is_read_without_a_network(tmp_path):
    page = small_site(tmp_path, "# Page\n\n$x^2$\n\n```python\nx = 1\n```\n")
    fetched = re.findall(r"<(?:script|link|img|iframe)[^>]*(?:src|href)=\"?([^\" >]+)", page)
    assert fetched
    assert [address for address in fetched if "//" in address] == []


def formulas(page):
    """TeX of a page: what is displayed, and what stands in lines."""
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    displayed = re.findall(r"\$\$(.*?)\$\$", text, re.DOTALL)
    return displayed, re.findall(r"\$([^$\n]+)\$", re.sub(r"\$\$.*?\$\$", "", text, flags=re.DOTALL))


@pytest.mark.parametrize("page", THEORY, ids=lambda page: page.stem)
def test_every_formula_of_the_theory_is_set_and_keeps_its_number(page):
    site_formulas = hook("site_formulas")
    displayed, inline = formulas(page)
    set_apart = [site_formulas.formula(rf"\[{tex}\]", displayed=True) for tex in displayed]
    in_lines = [site_formulas.formula(rf"\({tex}\)", displayed=False) for tex in inline]
    assert [mathml for mathml in (*set_apart, *in_lines) if "\\" in mathml or "&amp;" in mathml] == []
    shown = [number for mathml in set_apart for number in re.findall(r'href="#eq-(\d+)"', mathml)]
    assert shown == [number for tex in displayed for number in re.findall(r"\\tag\{(\d+)\}", tex)]


@pytest.mark.parametrize(
    ("tex", "sign"), [(r"\mathrel{+}=", "&#x0002B;="), (r"\mathrel{-}=", "&#x02212;="), (":=", ":=")]
)
def test_a_sign_of_two_characters_is_set_as_one(tex, sign):
    assert f"<mo>{sign}</mo>" in hook("site_formulas").formula(rf"\(x {tex} y\)", displayed=False)


def test_a_formula_that_cannot_be_set_ends_the_build():
    with pytest.raises(ValueError, match=r"\\nonsense is not understood"):
        hook("site_formulas").formula(r"\(x \nonsense y\)", displayed=False)


def test_every_public_name_stands_on_the_api_page_once():
    page = hook("site_procedures").on_page_markdown(
        (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    )
    assert sorted(re.findall(r"^::: tumble\.(\w+)$", page, re.MULTILINE)) == sorted(
        set(tumble.__all__) - {"__version__"}
    )


def test_every_procedure_has_its_page_in_the_list_of_pages():
    config = hook("site_procedures").on_config(load_config(str(ROOT / "mkdocs.yml"), hooks=[]))
    listed = re.findall(r"how-to/([\w-]+)\.md", str(config.nav))
    assert sorted(listed) == sorted(path.stem for path in (DOCS / "how-to").glob("*.md"))


def test_links_that_leave_the_documentation_lead_to_pages_of_the_site():
    site_repository = hook("site_repository")
    for page in sorted(DOCS.rglob("*.md")):
        for target in site_repository.linked(page):
            if target.is_relative_to(DOCS) or not target.exists():
                continue
            uri = site_repository.site_uri(target)
            assert uri.endswith(".md")
            assert site_repository.repository_path(uri) == target
            assert site_repository.shown(target)


def test_doctests_of_a_docstring_are_shown_as_code():
    docstring = "Add.\n\n>>> 1 + 1  # doctest: +SKIP\n2\n\nMore.\n"
    assert hook("site_doctests").fenced(docstring) == "Add.\n\n```pycon\n>>> 1 + 1\n2\n```\n\nMore.\n"


def test_a_formula_that_markdown_did_not_see_ends_the_build(tmp_path, caplog):
    page = "# Page\n\n```sh\necho $$\n```\n\n<p>$$x \\tag{1}$$</p>\n"
    with pytest.raises(Abort):
        small_site(tmp_path, page, hooks=["scripts/site_formulas.py"])
    assert "index.md: a formula is not seen: $$x" in caplog.text


def test_every_option_of_every_command_stands_on_the_page_of_commands():
    listed = hook("site_commands").commands()
    for word in COMMANDS:
        assert re.search(rf"^## tumble {word}$", listed, re.MULTILINE)
    turntable = listed.split("## tumble spin")[0]
    root = typer.main.get_command(command_line(["turntable"]))
    options = {name for each in root.commands["turntable"].params for name in each.opts}
    assert [name for name in options - {"--help", "-h"} if name not in turntable] == []
    assert r"`--clock auto\|shared\|apart`" in turntable


def test_bars_in_code_of_tables_are_shown_without_their_backslash(tmp_path):
    table = "# Page\n\n| typed |\n|---|\n| `--clock auto\\|shared` |\n\n`a\\|b`\n"
    page = small_site(tmp_path, table, hooks=["scripts/site_tables.py"])
    assert "<code>--clock auto|shared</code>" in page
    assert r"<code>a\|b</code>" in page

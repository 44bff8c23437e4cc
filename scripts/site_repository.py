"""Take into the documentation site what its pages link to elsewhere in the repository.

A hook of mkdocs, named in `mkdocs.yml`. A page stays one, a file becomes a page that shows it, a folder
a page that shows all its files, each in the folder `repository` of the site.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
LINK = re.compile(r"(?<=\]\()(?!\w+:|#)([^)\s#]+)")
LANGUAGES = {
    ".c": "c",
    ".h": "c",
    ".cpp": "cpp",
    ".hpp": "cpp",
    ".py": "python",
    ".rs": "rust",
    ".yaml": "yaml",
    ".txt": "cmake",
}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds what pages link to, and what the added pages link to in turn."""
    waiting = list(DOCS.rglob("*.md"))
    known = {path.resolve() for path in waiting}
    while waiting:
        for target in linked(waiting.pop()):
            if target in known or target.is_relative_to(DOCS) or not target.exists():
                continue
            known.add(target)
            file = File.generated(config, site_uri(target), content=shown(target))
            file.inclusion = InclusionLevel.NOT_IN_NAV
            files.append(file)
            if target.suffix == ".md":
                waiting.append(target)
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Points links of a page into the repository to their places on the site."""
    here = repository_path(page.file.src_uri)

    def led(found: re.Match[str]) -> str:
        target = (here.parent / found[1]).resolve()
        if not target.exists() or (here.is_relative_to(DOCS) and target.is_relative_to(DOCS)):
            return found[1]
        return os.path.relpath(site_uri(target), Path(page.file.src_uri).parent)

    return LINK.sub(led, markdown)


def linked(page: Path) -> Iterator[Path]:
    """Returns what a page of the repository links to."""
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        yield (page.parent / target).resolve()


def site_uri(path: Path) -> str:
    """Place on the site of a file or folder of the repository."""
    if path.is_relative_to(DOCS):
        return path.relative_to(DOCS).as_posix()
    inside = f"repository/{path.relative_to(ROOT).as_posix()}"
    return inside if path.suffix == ".md" else f"{inside}.md"


def repository_path(uri: str) -> Path:
    """Path in the repository of a page of the site."""
    if not uri.startswith("repository/"):
        return DOCS / uri
    path = ROOT / uri.removeprefix("repository/")
    return path if path.exists() else path.with_suffix("")


def shown(path: Path) -> str:
    """Returns the page that shows a file, or every file of a folder."""
    if path.suffix == ".md":
        return path.read_text(encoding="utf-8")
    name = path.relative_to(ROOT).as_posix()
    if path.is_dir():
        parts = [f"## {file.name}\n\n{code(file)}" for file in sorted(path.iterdir()) if file.is_file()]
        return "\n\n".join([f"# {name}", *parts])
    return f"# {name}\n\n{code(path)}"


def code(path: Path) -> str:
    """Returns a file as a block of code."""
    return f"````{LANGUAGES.get(path.suffix, 'text')}\n{path.read_text(encoding='utf-8')}\n````"

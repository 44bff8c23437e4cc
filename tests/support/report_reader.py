"""A page of a report taken apart, for tests."""

from __future__ import annotations

import re
from html.parser import HTMLParser

VOID = {"meta", "link", "br", "hr", "img", "input", "circle"}


class Page(HTMLParser):
    """A page taken apart; raises AssertionError where its tags do not nest."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.links, self.ids, self.sources, self.text = [], [], [], [], []
        self.tags, self.rows, self.references = set(), [], re.findall(r"url\(#([^)]+)\)", text)
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.note(tag, attributes)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th") and self.rows:
            self.rows[-1].append("")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.note(tag, attributes)

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.text.append(data)
            if self.rows and self.open and {"td", "th"} & set(self.open):
                self.rows[-1][-1] += data

    def note(self, tag, attributes):
        self.tags.add(tag)
        for key, value in attributes:
            if key == "id":
                self.ids.append(value)
            if key == "href":
                self.links.append(value)
            if key in ("src", "srcset", "data", "action") or key.startswith(("on", "xlink")):
                self.sources.append(f"{key}={value}")

    @property
    def words(self):
        return re.sub(r"\s+", " ", " ".join(self.text))

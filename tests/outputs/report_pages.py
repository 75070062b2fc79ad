"""A page of a report as its elements, for the tests of what it says and what it is made of."""

import json
from html.parser import HTMLParser

VOID = {"meta", "br", "hr", "col", "img"}


class Page(HTMLParser):
    """A page as its elements, failing where one is not closed in order."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.tags, self.attributes, self.words, self.blocks = [], [], [], [], {}
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag not in VOID:
            self.open.append((tag, dict(attrs)))

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        if self.open and self.open[-1][0] == "script":
            self.blocks[self.open[-1][1].get("id")] = data
        elif self.open and self.open[-1][0] != "style":
            # What a picture holds is no text of the page.
            if any(tag == "svg" for tag, _ in self.open):
                return
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())

    @property
    def data(self):
        return json.loads(self.blocks["lashbench-report"])

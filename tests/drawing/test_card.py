"""Cards: every text is escaped, nothing runs, and the size is limited."""

from html.parser import HTMLParser

from realitygap.drawing import Bar, Card, Line, Picture, Spark, Table

HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(1)>&amp;\x00\x1b[31m\ud800"
VOID = {"line", "circle", "polyline"}


class Page(HTMLParser):
    """The elements and attributes of a page; complains of an end without a beginning."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.attributes, self.texts, self._open = [], set(), [], []
        self.feed(page)
        assert self._open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes |= {name for name, _ in attributes}
        self._open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes |= {name for name, _ in attributes}

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, text):
        self.texts.append(text)


def check_safe(page):
    """A card runs nothing, loads nothing, styles nothing but itself, and is not too large."""
    parsed = Page(page)
    assert not {"script", "img", "iframe", "object", "link", "a", "form"} & set(parsed.tags)
    assert not {name for name in parsed.attributes if name.startswith("on") or name in ("src", "href")}
    style = page[page.index("<style>") + 7 : page.index("</style>")]
    assert "@import" not in style
    assert "url(" not in style
    selectors = [rule.split("{")[-2].strip() for rule in style.split("}") if rule.strip() and "{" in rule]
    assert all(".rg-card" in part for selector in selectors for part in selector.split(","))
    assert len(page.encode()) <= 200_000
    return parsed


def picture(text):
    return Picture(text, text, 0, 0, 1, 1, (Line(((0, 0), (1, 1))),))


def test_every_text_of_a_card_is_escaped():
    table = Table([HOSTILE], [[HOSTILE]], HOSTILE, closed=True)
    card = Card(HOSTILE, [HOSTILE], HOSTILE, HOSTILE, [HOSTILE, table, picture(HOSTILE)], [HOSTILE])
    parsed = check_safe(card.to_html())
    assert "".join(parsed.texts).count("<script>alert(1)</script>") == 11


def test_numbers_that_are_not_there_leave_their_marks_out():
    bars = [Bar(None, None, None, 0, 1), Bar(0.5, None, None, 0, 1), Bar(0.0, -1.0, 1.0, -1, 1)]
    page = Card("a", parts=[Table(["bar", "spark"], [[bar, Spark((), 0, 1)] for bar in bars])]).to_html()
    assert page.count("<circle") == 2
    assert page.count('class="rg-card-interval"') == 1
    assert "polyline" not in page.partition("</style>")[2]


def test_bars_and_lines_stay_on_their_axes():
    assert [Bar(0, 0, 0, -1.0, 3.0).at(value) for value in (-9.0, -1.0, 0.0, 3.0, 9.0)] == [
        0,
        0,
        25,
        100,
        100,
    ]
    assert Bar(0, 0, 0, 1.0, 1.0).at(1.0) == 0
    assert Spark((1.0, 2.0, 3.0), 1.0, 3.0).points == "2.0,18.0 45.0,10.0 88.0,2.0"
    assert Spark((1.0,), 1.0, 1.0).points == "2.0,18.0"


def test_a_card_has_at_most_200_kb():
    rows = [["x" * 10_000] * 40] * 1_000
    page = Card("large", lead="stays", parts=[Table(["a"] * 40, rows)]).to_html()
    check_safe(page)
    assert "stays" in page
    assert "too large for a notebook" in page
    page = Card("long", parts=[Table(["a"], [["x"]] * 1_234)]).to_html()
    assert page.count("<tr>") == 101
    assert "1,134 more rows are not shown." in page


def test_colors_of_a_picture_follow_the_theme_and_are_there_without_a_style():
    page = Card("a", parts=[picture("a")]).to_html().partition("</style>")[2]
    assert 'stroke="var(--ink-text, #1c1f24)"' in page
    assert '"#' not in page

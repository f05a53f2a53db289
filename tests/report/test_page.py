from __future__ import annotations

import re
import socket
from html.parser import HTMLParser
from pathlib import Path

import pytest

import realitygap
from realitygap.errors import RecordError
from realitygap.records import ResultsFolder
from realitygap.report import summarize, write_report
from realitygap.report._template import packed, template_text
from realitygap.study import run_study
from tests.report.results import describe, random_runs, settings, write_results

VOID = {"meta", "br", "hr", "img", "input", "link", "col"}


class Page(HTMLParser):
    """A page taken apart: that tags close in order, which ids and references there are, and its text."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.ids: list[str] = []
        self.text: list[str] = []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        assert len(values) == len(attrs), f"{tag} repeats an attribute"
        self.tags.append((tag, values))
        if "id" in values:
            self.ids.append(values["id"])
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if "id" in dict(attrs):
            self.ids.append(dict(attrs)["id"])

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.text.append(data)

    @property
    def words(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.text))


def report(folder) -> tuple[str, Page]:
    html = write_report(folder).read_text("utf-8")
    return html, Page(html)


@pytest.fixture(scope="module")
def tiny_page(tiny_html):
    return tiny_html, Page(tiny_html)


def test_page_needs_nothing_from_elsewhere(tiny_page):
    html, page = tiny_page
    assert "http:" not in html
    assert "https:" not in html
    assert not {"link", "img", "iframe", "image", "object", "embed"} & {tag for tag, _ in page.tags}
    for _, attributes in page.tags:
        assert not {"src", "srcset", "xlink:href", "onload", "onclick"} & set(attributes)
        assert attributes.get("href", "#").startswith("#")
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", html))
    assert "@import" not in html


def test_ids_are_unique_and_references_lead_somewhere(tiny_page):
    html, page = tiny_page
    assert len(set(page.ids)) == len(page.ids)
    wanted = re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)|aria-labelledby="([^"]+)"', html)
    assert {next(filter(None, target)) for target in wanted} <= set(page.ids)


def test_page_can_be_heard(tiny_page):
    _, page = tiny_page
    pictures = [
        attributes
        for tag, attributes in page.tags
        if tag == "svg" and "aria-hidden" not in attributes and "replay" not in attributes.get("id", "")
    ]
    assert len(pictures) == 15, "7 figures, each wide and narrow, and a path for readers without a script"
    assert all(each["role"] == "img" and len(each["aria-label"]) > 40 for each in pictures)
    headings = [tag for tag, _ in page.tags if re.fullmatch(r"h\d", tag)]
    assert headings[0] == "h1"
    assert set(headings[1:]) == {"h2", "h3"}
    assert [tag for tag, _ in page.tags].count("caption") == [tag for tag, _ in page.tags].count("table")
    assert ("a", {"class": "skip", "href": "#main"}) in page.tags
    assert ("html", {"lang": "en"}) in page.tags


def test_figures_and_tables_are_numbered_in_the_order_of_the_page(tiny_page):
    html, _ = tiny_page
    for word, count in (("Figure", 7), ("Table", 8)):
        numbers = re.findall(rf"<b>{word} (\d+)\.</b>", html)
        assert list(map(int, numbers)) == list(range(1, count + 1))
    figures = re.findall(r"<figure id=.*?</figure>", html, re.S)
    counterparts = [re.findall(r"paper’s Figure (\d)", figure) for figure in figures]
    assert [each for found in counterparts for each in found] == list("4572")


def test_navigation_lists_the_sections_in_the_order_of_the_page(tiny_page):
    html, _ = tiny_page
    headings = re.findall(r'<h2 id="([^"]+)">([^<]+)</h2>', html)
    assert headings[0] == ("findings", "Findings and replay")
    navigations = re.findall(r'<nav aria-label="Contents">(.*?)</nav>', html, re.S)
    assert len(navigations) == 2, "beside the text, and folded on a phone"
    for navigation in navigations:
        assert re.findall(r'<a href="#([^"]+)">([^<]+)</a>', navigation) == headings


def test_findings_lead_to_the_tables_that_they_name(tiny_page):
    html, page = tiny_page
    findings = html.partition('<ol class="findings">')[2].partition("</ol>")[0]
    links = re.findall(r'<a href="#caption-([a-z]+)">(Table \d+)</a>', findings)
    assert links
    for anchor, table in links:
        assert f'<caption id="caption-{anchor}"><b>{table}.</b>' in html
    assert "In fresh trials, novelty search covers more than objective search." in page.words


def test_page_says_what_was_run(tiny_page, tiny_study):
    _, page = tiny_page
    assert tiny_study.digest() in page.words
    assert "A tiny study" in page.words
    assert "28 (7 planned for each condition)" in page.words
    assert f"{28 * 24}, one for each network" in page.words
    assert f"{28 * 24 * 30:,}" in page.words
    assert "realitygap run STUDY.toml --seed 1 --replicates 7 --out DIR" in page.words
    assert "no robot was driven" in page.words
    assert "Abandoning objectives" in page.words, "the study has a condition with novelty"


def test_numbers_are_those_of_the_summary(tiny_page, tiny_study):
    html, _ = tiny_page
    table = re.search(r"<table class=\"numbers\">.*?</table>", html, re.S)[0]
    rows = re.findall(r"<tr><th scope=\"row\">.*?</tr>", table)
    summary = summarize(tiny_study)
    assert len(rows) == summary.height == 4
    for html_row, row in zip(rows, summary.iter_rows(named=True), strict=True):
        cells = [re.sub(r"<[^>]+>", "", cell) for cell in re.findall(r"<t[hd].*?</t[hd]>", html_row)]
        expected = [row["condition"], row["label"], str(row["n"])]
        for which in ("line", "ends"):
            expected.append(f"{row[f'{which}_median']:.3f}")
            expected.append(f"[{row[f'{which}_low']:.3f}, {row[f'{which}_high']:.3f}]")
            expected.append(f"[{row[f'{which}_q25']:.3f}, {row[f'{which}_q75']:.3f}]")
        expected += [f"{value:.3f}" for value in row["published"] or []] or ["–"] * 3
        assert cells == expected


def test_interval_is_described_as_it_is(tiny_page):
    _, page = tiny_page
    assert (
        "With n = 7, it extends from the 1st to the 7th of the ordered values and covers the median with 98.4 %"
        in (page.words)
    )


def test_input_nodes_are_counted_by_condition(tiny_page):
    _, page = tiny_page
    assert "Input nodes 3; 4 with novelty 3 ; 4 in novelty" in page.words


def test_settings_that_differ_are_marked(tiny_page):
    html, _ = tiny_page
    marked = re.findall(r"<mark>(.*?)</mark>", html)
    assert sorted(marked) == ["0.9", "ends", "novelty"]
    assert "<code>neat.add_link</code>" in html


@pytest.mark.slow
def test_a_study_that_comes_along_is_rerun_by_name(out):
    from realitygap.study import load_study, run_study

    folder = run_study(load_study("paper", replicates=1), out).folder
    _, page = report(folder)
    assert "The study comes with realitygap." in page.words
    assert "realitygap run paper --seed 1 --replicates 1 --out DIR" in page.words


@pytest.mark.slow
def test_hostile_text_stays_text(out, no_replay):
    evil = "<script>alert(1)</script>\"'&${x}$ \x07 url(http://x) #1c1f24"
    conditions = [
        describe("base", label=evil, published=[0.2], published_source=evil),
        describe(
            "other", label=evil, baseline="base", change=evil, settings=settings(selection=evil, noise=evil)
        ),
    ]
    coverages = {"base": random_runs(6), "other": random_runs(6)}
    folder = write_results(out, conditions, coverages, title=evil, name=evil, software=evil, seed=evil)
    html, page = report(folder)
    assert len(re.findall("<script", html)) == 2, "the values of figures, and what shows them"
    assert "<script>alert" not in html
    assert "alert(1)" in page.words
    assert len(set(page.ids)) == len(page.ids)


def test_incomplete_study_says_what_is_missing(out, no_replay):
    conditions = [describe("c"), describe("d")]
    folder = write_results(out, conditions, {"c": random_runs(3)}, replicates=10)
    _, page = report(folder)
    assert "The study is incomplete" in page.words
    assert "3 of 20 runs are complete. c lacks 7 (runs 3 to 9); d lacks 10 (runs 0 to 9)." in page.words
    assert "no runs yet" in page.words


def test_complete_study_has_no_banner(tiny_page):
    html, _ = tiny_page
    assert 'class="banner"' not in html


def test_other_version_is_announced_and_not_warned_of(out, monkeypatch, recwarn):
    for module in ("_folder", "_published_results", "_chunk"):
        monkeypatch.setattr(f"realitygap.records.{module}.RESULTS_VERSION", 99)
    strange = describe("c", settings=settings(flux=3))
    folder = write_results(out, [strange], {"c": random_runs(2)})
    monkeypatch.undo()
    _, page = report(folder.path)
    assert "Results of another version" in page.words
    assert "results version 99" in page.words
    assert "cannot read its settings" in page.words
    assert len(recwarn) == 0


@pytest.mark.parametrize(("n", "generations"), [(1, 3), (2, 1), (1, 1)])
def test_the_smallest_studies_have_a_page(out, no_replay, n, generations):
    folder = write_results(out, [describe("only")], {"only": random_runs(n, generations)})
    html, page = report(folder)
    assert f"With n = {n} there is no interval" in page.words
    assert 'id="figure-individuals-coverage"' in html
    assert "Choices" not in page.words


def test_conditions_without_settings_have_a_page(out, no_replay):
    _, page = report(write_results(out, ["c"], {"c": random_runs(2)}))
    assert "unlabeled" in page.words
    assert "Abandoning objectives" not in page.words


def test_no_rows_is_a_clear_error_and_leaves_nothing(out):
    write_results(out, [describe("c")], {})
    with pytest.raises(RecordError, match="holds no trials yet"):
        write_report(out)
    assert not list(out.glob("*report*"))


@pytest.mark.slow
def test_page_goes_where_it_is_told_and_replaces_what_is_there(tiny_study, tmp_path):
    path = tmp_path / "page.html"
    path.write_text("old")
    assert write_report(tiny_study.path, path) == path
    assert path.read_text("utf-8").startswith("<!DOCTYPE html>")
    assert [each.name for each in tmp_path.iterdir()] == ["page.html"]


@pytest.mark.slow
def test_a_folder_that_is_not_there_is_a_clear_error(tiny_study, tmp_path):
    with pytest.raises(RecordError, match="Could not write"):
        write_report(tiny_study, tmp_path / "nowhere" / "page.html")


@pytest.mark.parametrize("name", ["page.svg", "page.toml", "page.html.csv"])
def test_a_report_is_a_page(tiny_study, tmp_path, name):
    with pytest.raises(RecordError, match=r"expected \.html"):
        write_report(tiny_study, tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["study.json", "trials/report.html", ".lock", "log.jsonl"])
def test_a_page_never_takes_the_place_of_results(tiny_study, name):
    """The study itself was replaced, and all was well."""
    digest = tiny_study.digest()
    with pytest.raises(RecordError, match="nothing was written"):
        write_report(tiny_study, tiny_study.path / name)
    assert ResultsFolder.open(tiny_study.path).digest() == digest


@pytest.mark.slow
def test_the_same_results_give_the_same_page_without_a_network(tiny_study, tiny_html, tmp_path, monkeypatch):
    def refuse(*_: object) -> None:
        raise AssertionError("a socket was opened")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    assert write_report(tiny_study, tmp_path / "page.html").read_text("utf-8") == tiny_html


def test_page_is_small(tiny_html):
    assert len(tiny_html.encode()) < 1_000_000


@pytest.mark.slow
def test_the_study_s_remark_stands_under_its_summary(tmp_path):
    page = write_report(run_study("paper", tmp_path / "r", replicates=1).folder).read_text("utf-8")
    assert page.count("which does not say which search it reports") == 1


def test_no_line_ends_between_a_number_and_its_unit(tiny_page):
    html, _ = tiny_page
    bare = re.sub(r"<(script|style|svg|pre|code)\b.*?</\1>|<[^>]*>", "|", html, flags=re.DOTALL)
    assert "95\u00a0%" in bare
    assert not re.findall(r"\d (?:%|m|s|in)(?!\w)", bare)


def test_scripts_join_a_number_and_its_unit():
    for path in Path(realitygap.__file__).parent.rglob("*.js"):
        code = re.sub(r"(?:^|\s)//.*", "", path.read_text("utf-8"))
        found = re.findall(r".*[\d}] (?:%|m?s|min|h|[cmk]?m|m?V|Hz|°|[kM]B|px)(?!\w).*", code)
        assert found == [], path.name


def test_script_that_shows_values_has_at_most_2_kb(tiny_page):
    script = packed(template_text("hover.js"))
    assert len(script.encode()) <= 2048
    assert script in tiny_page[0]
    assert "  " not in script

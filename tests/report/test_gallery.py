"""The figures that show a study: arena, all individuals, better ones, networks, species; and their export."""

from __future__ import annotations

import csv
import itertools
import re
import xml.etree.ElementTree as ET

import numpy as np
import polars as pl
import pytest

from realitygap.drawing import PENS, Disc, Line, Text, line_pen
from realitygap.errors import RecordError
from realitygap.evolution import network_picture
from realitygap.platforms import JyroPlatform
from realitygap.report import (
    NARROW,
    _arena_figure,
    draw_individuals,
    draw_lineage,
    draw_networks,
    draw_species,
    draw_trial,
    save_drawing,
    write_report,
)
from realitygap.report._individuals_figure import _moved_apart
from realitygap.report._species_figure import count_species
from realitygap.report._structures import _canonical, count_structures, structures_frame
from realitygap.report._table import Cell, Column, Part, TableOnPage, latex_table
from realitygap.report._tally import read_tally
from realitygap.report._template import page_environment
from realitygap.report.charts.house import inline
from realitygap.runs import Condition, genome_of, replay
from realitygap.study import parse_study, run_study
from realitygap.world import arena_picture, paper_arena
from tests.report.results import describe, random_runs, write_results


def draw_arena_and_robot(folder, condition=None):
    tally = read_tally(folder)
    return _arena_figure.draw_arena_and_robot(tally, tally.name_of(condition), name="arena")


ALL = [
    draw_arena_and_robot,
    draw_individuals,
    draw_networks,
    draw_species,
    draw_lineage,
    draw_trial,
]


def texts(svg: str) -> list[str]:
    return ["".join(each.itertext()) for each in ET.fromstring(svg).iter() if each.tag.endswith("text")]


def resolved(study, name: str) -> Condition:
    described = next(each for each in study.description["conditions"] if each["name"] == name)
    return Condition.from_settings(name, described["settings"])


@pytest.mark.parametrize("draw", ALL)
def test_every_figure_has_its_label_and_n(tiny_study, draw):
    drawing = draw(tiny_study)
    assert "SIM" in drawing.caption
    assert re.search(r"\bn = |Drawn from", drawing.caption)
    assert len(drawing.alt) > 40


@pytest.mark.parametrize("draw", ALL)
def test_figures_are_sound_alone_and_on_a_page(tiny_study, draw):
    drawing = draw(tiny_study)
    root = ET.fromstring(drawing.svg)
    ids = [each.get("id") for each in root.iter() if each.get("id")]
    assert len(set(ids)) == len(ids)
    page = inline(drawing.svg)
    assert not re.findall(r"(?:fill|stroke): #\w+", page), "all colors are variables, for light and dark"
    assert draw(tiny_study).svg == drawing.svg


@pytest.mark.parametrize("draw", ALL[:-1])
def test_narrow_figures_are_others(tiny_study, draw):
    assert draw(tiny_study).in_width(NARROW).svg != draw(tiny_study).svg


def test_all_individuals_of_all_generations_are_drawn(tiny_study):
    drawing = draw_individuals(tiny_study, "novelty", 2)
    drawn = texts(drawing.svg)
    for individual in range(8):
        assert drawn.count(str(individual)) == 3, "its number stands in each of three generations"
        assert f"individual {individual}" in drawn
    assert "all 8 individuals of every generation" in drawing.caption
    for color, _ in PENS:
        assert f"stroke: {color}" in drawing.svg


def test_each_pen_has_dashes_of_its_own():
    assert len({dashes for _, dashes in PENS}) == len({color for color, _ in PENS}) == 8
    assert tuple(line_pen(k) for k in range(8)) == PENS
    assert len({line_pen(k) for k in range(64)}) == 64


def test_best_of_each_generation_is_named(tiny_study):
    rows = tiny_study.read("coverage", [1])
    drawn = texts(draw_individuals(tiny_study, "coverage", 1).svg)
    for generation in range(3):
        best = rows.filter(pl.col("generation") == generation)["coverage_line"]
        assert f"SIM, best: {best.arg_max()}, coverage {best.max():.3f}" in drawn


def test_ends_that_coincide_are_moved_apart():
    ends = np.zeros((8, 2))
    places = _moved_apart(ends, 0.1)
    distances = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))[~np.eye(8, dtype=bool)]
    assert distances.min() > 0.085
    apart = np.array([[0.0, 0.0], [1.0, 0.0]])
    assert np.abs(_moved_apart(apart, 0.1) - apart).max() < 0.01


def test_paths_that_cannot_be_recomputed_are_said_to_be_missing(tiny_study, no_replay):
    assert "Some paths are missing" in draw_individuals(tiny_study).caption


def test_unknown_condition_and_run_are_clear_errors(tiny_study):
    for draw in (draw_individuals, draw_species, draw_lineage, draw_trial):
        with pytest.raises(ValueError, match="Did you mean 'novelty'"):
            draw(tiny_study, "noveltyy")
        with pytest.raises(ValueError, match=r"has no run 99 .*its runs are 0 to 6"):
            draw(tiny_study, "novelty", 99)


def test_the_arena_is_drawn_to_scale_with_its_dimensions(tiny_study):
    drawn = texts(draw_arena_and_robot(tiny_study).svg)
    for text in (
        "1.067 m (42 in)",
        "0.61 m (24 in)",
        "12 × 6 cells of 0.076 m (3 in)",
        "0.18 m",
        "0.16 m",
        "sees 0.2 m",
    ):
        assert text in drawn
    robot = JyroPlatform()
    shapes = arena_picture(paper_arena(), robot.body, robot.sensors).shapes
    lines = [shape.points for shape in shapes if isinstance(shape, Line)]
    start = paper_arena().start
    corners = {(round(start.x + x, 6), round(start.y + y, 6)) for x, y in robot.body.corners}
    assert any({(round(x, 6), round(y, 6)) for x, y in points} == corners for points in lines)
    rays = [
        points for points in lines if len(points) == 2 and points[1][0] - points[0][0] == pytest.approx(0.2)
    ]
    assert sorted(round(points[0][1] - start.y, 6) for points in rays) == [-0.05, 0.0, 0.05]


def test_a_network_has_a_disc_for_each_node_and_a_line_for_each_enabled_gene(tiny_study):
    condition = resolved(tiny_study, "novelty")
    rows = tiny_study.read("novelty").sort("nodes", descending=True)
    for row in rows[[0, 1, 2, rows.height - 1]].iter_rows(named=True):
        genome = genome_of(condition, row)
        names = condition.task.input_names("novelty"), condition.task.output_names
        picture = network_picture(genome, *names)
        assert sum(isinstance(shape, Disc) for shape in picture.shapes) == len(genome.nodes)
        weights = [s.text for s in picture.shapes if isinstance(s, Text) and s.text[0] in "+−"]
        assert len(weights) == genome.n_enabled
        n_positive = sum(gene.weight >= 0 for gene in genome.connections if gene.enabled)
        assert sum(text[0] == "+" for text in weights) == n_positive
        for name in ("obstacle", "stall", "time", "bias", "move", "turn"):
            assert any(isinstance(s, Text) and s.text == name for s in picture.shapes)
        fewer = network_picture(genome, *names, show_disabled=False)
        n_disabled = len(genome.connections) - genome.n_enabled
        assert len(picture.shapes) - len(fewer.shapes) == n_disabled
        ET.fromstring(picture.to_svg())


def test_names_of_inputs_must_be_as_many_as_inputs(tiny_study):
    genome = genome_of(resolved(tiny_study, "coverage"), tiny_study.read("coverage", [0]).row(0, named=True))
    with pytest.raises(ValueError, match="input_names has 2 names, expected 3"):
        network_picture(genome, ["a", "b"])


def test_structures_are_counted_once_each(tiny_study):
    groups = count_structures(read_tally(tiny_study))
    assert {group.selection: len(group.inputs) for group in groups} == {"coverage": 3, "novelty": 4}
    by_selection = {group.selection: group for group in groups}
    assert by_selection["novelty"].n_networks == 7 * 8
    assert by_selection["coverage"].n_networks == 3 * 7 * 8
    for group in groups:
        assert sum(structure.n for structure in group.found) == group.n_networks
        assert len({structure.links for structure in group.found}) == len(group.found)
    assert by_selection["novelty"].found[0].words == "all direct links"
    frame = structures_frame(groups)
    assert frame["share"].sum() == pytest.approx(2.0)
    assert frame.height == sum(len(group.found) for group in groups)


def test_structure_does_not_depend_on_the_numbers_of_hidden_nodes():
    names = {0: "in", 1: "out"}
    one = _canonical(((0, 7), (7, 1), (0, 9), (9, 7)), names)
    other = _canonical(((0, 9), (9, 1), (0, 7), (7, 9)), names)
    assert one == other
    assert one != _canonical(((0, 7), (7, 1), (0, 9), (9, 1)), names)


def test_numbers_of_species_are_those_of_the_rows(tiny_study):
    counts = count_species(read_tally(tiny_study))
    rows = tiny_study.read("turn", [4])
    for generation in range(3):
        expected = rows.filter(pl.col("generation") == generation)["species"].n_unique()
        found = counts.filter(
            pl.col("condition") == "turn", pl.col("replicate") == 4, pl.col("generation") == generation
        )
        assert found["species"].to_list() == [expected]


def test_a_trial_shows_what_its_row_says(tiny_study):
    drawing = draw_trial(tiny_study, "novelty", 1, 2, 5)
    row = tiny_study.read("novelty", [1]).filter(pl.col("generation") == 2, pl.col("individual") == 5)
    assert f"coverage {row['coverage_line'][0]:.3f}" in drawing.caption
    assert f"{row['stalls'][0]} of them blocked" in drawing.caption
    for text in ("left", "middle", "right", "obstacle", "move", "turn", "time [s]"):
        assert text in texts(drawing.svg)
    with pytest.raises(ValueError, match="its generations are 0 to 2"):
        draw_trial(tiny_study, "novelty", 1, 3)
    with pytest.raises(ValueError, match="its individuals are 0 to 7"):
        draw_trial(tiny_study, "novelty", 1, 2, 8)


def test_notebooks_show_arena_robot_genome_and_trajectory(tiny_study):
    condition = resolved(tiny_study, "novelty")
    row = tiny_study.read("novelty", [0]).row(3, named=True)
    for thing in (paper_arena(), JyroPlatform(), genome_of(condition, row), replay(condition, row)):
        root = ET.fromstring(thing._repr_svg_())
        assert [each.tag.split("}")[1] for each in root][:2] == ["title", "desc"]
        assert all("".join(each.itertext()) for each in list(root)[:2])


@pytest.mark.slow
def test_rows_without_networks_have_a_page(out, no_replay):
    folder = write_results(out, [describe("c")], {"c": random_runs(6)})
    page = write_report(folder).read_text("utf-8")
    assert 'id="figure-individuals-coverage"' in page


@pytest.mark.parametrize(
    ("ending", "magic"), [(".svg", b"<svg"), (".pdf", b"%PDF-"), (".png", b"\x89PNG\r\n")]
)
def test_a_drawing_is_saved_by_its_ending_and_always_alike(tiny_study, tmp_path, ending, magic):
    first = save_drawing(draw_species(tiny_study), tmp_path / f"a{ending}").read_bytes()
    second = save_drawing(draw_species(tiny_study), tmp_path / f"b{ending}").read_bytes()
    assert first.startswith(magic)
    assert first == second
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.slow
def test_export_writes_every_figure_and_table(tiny_study, tmp_path):
    page = write_report(tiny_study, tmp_path / "page.html", figures=tmp_path / "figures").read_text("utf-8")
    names = {each.name for each in (tmp_path / "figures").iterdir()}
    figures = re.findall(r'<figure id="(figure-[^"]+)"', page)
    assert len(figures) == 7
    for figure in figures:
        root = ET.fromstring((tmp_path / "figures" / f"{figure}.svg").read_bytes())
        assert [each.tag.split("}")[1] for each in root][:2] == ["title", "desc"]
        assert (tmp_path / "figures" / f"{figure}.pdf").read_bytes().startswith(b"%PDF-")
    captions = set(re.findall(r'<caption id="caption-([^"]+)">', page)) - {"replay"}
    assert captions <= {each.removeprefix("table-").removesuffix(".csv") for each in names}
    others = {"structures.csv", "data-species.csv", "data-comparisons.csv", "figures.txt"}
    assert {"table-parameters.csv", "table-results.csv", *others} <= names
    for name in names - {"figures.txt"}:
        assert name.rsplit(".", 1)[0] in page
    with (tmp_path / "figures" / "table-results.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["Condition"] for row in rows] == ["coverage", "novelty", "turn", "ends"]
    assert rows[0]["The paper: run 0"] == "0.154"
    for name, column in (("comparisons", "As recorded"), ("fresh", "Conclusion")):
        with (tmp_path / "figures" / f"table-{name}.csv").open(encoding="utf-8") as file:
            shown = list(csv.DictReader(file))
        compared = pl.read_csv(tmp_path / "figures" / f"data-{name}.csv")
        conclusions = [row[column] for row in shown if row[column]]
        assert sorted(conclusions) == sorted(compared["conclusion"])
    files = sorted((tmp_path / "figures").glob("*.tex"))
    captions = re.findall(r'<caption id="caption-([^"]+)"><b>Table', page)
    assert [file.stem for file in files] == sorted(f"table-{name}" for name in captions)
    for file in files:
        text = file.read_text("utf-8")
        kinds = re.search(r"\\begin\{tabular\}\{([lr]+)\}", text)[1]
        rows = [line for line in text.splitlines() if line.endswith(r"\\")]
        assert {len(re.findall(r"(?<!\\)&", row)) + 1 for row in rows if "multicolumn" not in row} == {
            len(kinds)
        }
        assert not re.search(r"(?<!\\)[%#_]", text)


def test_a_table_for_latex_escapes_its_texts_and_aligns_numbers():
    assert latex_table("a_b", "x", [["p", "q"], ["2·10⁻⁶", "−0.1 & –"], ["part", ""]]).splitlines()[2:9] == [
        r"\caption{a\_b}", r"\label{tab:x}", r"\begin{tabular}{rl}", r"\toprule", r"p & q \\", r"\midrule",
        r"2$\cdot10^{-6}$ & −0.1 \& -- \\",
    ]  # fmt: skip


@pytest.mark.slow
def test_a_page_without_export_names_no_files(tiny_html):
    assert "figures.txt" not in tiny_html


@pytest.mark.slow
def test_export_spares_the_rows_and_says_what_is_wrong(tiny_study, tmp_path):
    with pytest.raises(RecordError, match="holds the rows"):
        write_report(tiny_study, tmp_path / "page.html", figures=tiny_study.path / "trials")
    with pytest.raises(RecordError, match="Could not make the folder"):
        write_report(tiny_study, tmp_path / "page.html", figures=tmp_path / "no" / "where")
    assert not list(tmp_path.iterdir())


def test_a_table_for_programs_has_one_heading_a_column_plain_minus_and_no_dash():
    columns = (
        Column("who"),
        Column("line", "how far"),
        Column("ends", "how far"),
        Column("t"),
        Column("interval"),
    )
    table = TableOnPage("x", "A table", columns, (Part([("a", "−0.1", Cell("–"), "1", "2")], "group"),))
    assert table.heads == ["who", "how far: line", "how far: ends", "t", "interval"]
    assert table.texts == [["group", "", "", "", ""], ["a", "-0.1", "", "1", "2"]]


def test_columns_of_one_name_belong_to_the_column_before():
    columns = tuple(map(Column, ("who", "mean", "interval", "luck", "interval")))
    table = TableOnPage("x", "A table", columns, ())
    assert table.heads == ["who", "mean", "mean: interval", "luck", "luck: interval"]


def test_a_table_is_rendered_with_its_groups_parts_and_marks():
    columns = (Column("who"), Column("A12", "all", kind="median"), Column("b", "all"))
    row = ("a & b", Cell("1", element="mark"), Cell("2", kind="none", more="; 3"))
    shown = TableOnPage("x", "What A12 is", columns, (Part([row], "part"),), number=2)
    template = page_environment().from_string('{% from "_table.html.jinja" import table %}{{ table(shown) }}')
    page = template.render(shown=shown)
    assert '<caption id="caption-x"><b>Table 2.</b> What A<sub>12</sub> is</caption>' in page
    assert (
        '<th scope="col" rowspan="2">who</th><th scope="colgroup" colspan="2" class="group">all</th>' in page
    )
    assert '<tr class="group"><th scope="rowgroup" colspan="3">part</th></tr>' in page
    assert (
        '<th scope="row">a &amp; b</th><td class="median"><mark>1</mark></td>'
        '<td class="none">2<span class="others">; 3</span></td>'
    ) in page


def ancestors_of(rows: pl.DataFrame, generation: int, individual: int) -> set[tuple[int, int]]:
    """By walking back through the rows."""
    found, now = set(), {individual}
    for number in range(generation, -1, -1):
        here = rows.filter(pl.col("generation") == number, pl.col("individual").is_in(sorted(now)))
        found |= {(number, each) for each in now}
        now = {parent for parents in here["parents"] for parent in parents}
    return found


@pytest.mark.slow
def test_numbers_of_species_keep_apart_in_a_long_run(tmp_path):
    """Each species had its number at its largest share: hundreds of them lay over each other, and beyond the axes."""
    text = """
    [study]
    name = "long"
    replicates = 1
    [neat]
    population = 60
    generations = 40
    add_node = 0.5
    threshold = 1.0
    [platform.jyro]
    steps = 5
    [[condition]]
    name = "coverage"
    """
    folder = run_study(parse_study(text, "long.toml"), tmp_path / "r").folder
    drawing = draw_species(folder)
    left = drawing.figure.axes[0]
    drawing.figure.draw_without_rendering()
    numbers = [each for each in left.texts if each.get_text().isdigit()]
    boxes = [each.get_window_extent() for each in numbers]
    n_species = folder.read(columns=["species"])["species"].n_unique()
    assert 2 <= len(numbers) < n_species
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    assert all(left.bbox.y0 <= box.y0 and box.y1 <= left.bbox.y1 for box in boxes)
    assert len(left.collections) == n_species
    for generation in (0, 20, 39):
        tops = [band.get_paths()[0].vertices for band in left.collections]
        highest = max(v[np.abs(v[:, 0] - generation) <= 0.5, 1].max(initial=0) for v in tops)
        assert highest == pytest.approx(1.0)
    assert "Numbers name the larger species" in drawing.caption


def test_a_lineage_shows_every_ancestor_with_its_coverage_and_species(tiny_study):
    rows = tiny_study.read("novelty", [1])
    drawing = draw_lineage(tiny_study, "novelty", 1, 2, 5)
    ancestors = ancestors_of(rows, 2, 5)
    assert f"{len(ancestors) - 1} in all" in drawing.caption
    assert "Ancestors of novelty, run 1, generation 2, individual 5 (ringed" in drawing.caption
    drawn = texts(drawing.svg)
    coverages = []
    for generation, individual in ancestors:
        row = rows.filter(pl.col("generation") == generation, pl.col("individual") == individual).row(
            0, named=True
        )
        coverages.append(f"{row['coverage_line']:.3f}")
        assert str(row["species"]) in drawn
    assert sorted(text for text in drawn if re.fullmatch(r"0\.\d{3}", text)) == sorted(coverages)


def test_a_lineage_is_that_of_the_champion_of_the_typical_run(tiny_study):
    caption = draw_lineage(tiny_study, "coverage").caption
    replicate, generation, individual = map(
        int, re.search(r"run (\d+), generation (\d+), individual (\d+)", caption).groups()
    )
    rows = tiny_study.read("coverage", [replicate])
    best = rows.row(int(rows["coverage_line"].arg_max()), named=True)
    assert (best["generation"], best["individual"]) == (generation, individual)


def test_a_lineage_names_new_structure_and_a_long_one_is_drawn_without_numbers(tmp_path):
    text = """
    [study]
    name = "long"
    title = "Long"
    replicates = 1
    [neat]
    population = 20
    generations = 15
    add_node = 0.5
    [platform.jyro]
    steps = 10
    [[condition]]
    name = "coverage"
    """
    folder = run_study(parse_study(text, "long.toml"), tmp_path / "long").folder
    early = draw_lineage(folder, "coverage", 0, 14, 3)
    assert "Colors identify species" in early.caption
    assert not [each for each in texts(early.svg) if each.startswith("+ ")]
    n_dots = sum(len(line.get_xdata()) for line in early.figure.axes[0].lines if line.get_marker() == "o")
    n_ancestors = len(ancestors_of(folder.read("coverage", [0]), 14, 3))
    assert n_dots == n_ancestors + 1, "each has its dot, and the chosen one a ring besides"
    assert len(early.figure.axes[0].lines) < 20, "not one by one, which takes minutes for tens of thousands"
    lineage = folder.derive("lineage", "coverage")
    rows = folder.read("coverage").with_columns(lineage["new"])
    assert re.search(r"generation \d+: node h\d+", early.alt)
    grown = rows.filter(pl.col("generation") == 1, pl.col("new").list.len() == 2).row(0, named=True)
    shown = draw_lineage(folder, "coverage", 0, 1, grown["individual"])
    assert f"generation 1: node h{grown['genome']['hidden'][0]}" in shown.alt

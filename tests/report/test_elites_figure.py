"""The figure of archives by MAP-Elites."""

from __future__ import annotations

import re

import numpy as np
import pytest

from realitygap.report import NARROW, _replay, draw_elites, save_view, write_report
from realitygap.report._elites_figure import _map
from realitygap.report._replay import content
from realitygap.report._tally import read_tally
from realitygap.runs import corrected_archive, elites_of, retry_elites
from realitygap.study import parse_study, run_study

STUDY = """
[study]
name = "maps"
replicates = 2

[neat]
population = 12
generations = 3

[[condition]]
name = "neat"

[[condition]]
name = "flat"
selection = "map-elites"
archive = { descriptor = ["end"], cells = [8, 6] }

[[condition]]
name = "deep"
selection = "map-elites"
archive = { descriptor = ["end", "stall_share", "mean_move"], cells = [3, 3, 4, 2] }

[[condition]]
name = "spread"
selection = "map-elites"
archive = { kind = "cvt", descriptor = ["region_share"], cells = [10] }
"""


@pytest.fixture(scope="module")
def maps(tmp_path_factory):
    return run_study(parse_study(STUDY, "maps.toml"), tmp_path_factory.mktemp("maps")).folder


@pytest.mark.parametrize("name", ["flat", "deep", "spread"])
def test_it_shows_the_archive_as_found_and_corrected(maps, name):
    study = parse_study(STUDY, "maps.toml")
    condition = next(each for each in study.conditions if each.name == name)
    drawn = draw_elites(maps, name, 1)
    elites = elites_of(condition, maps.read(name, [1]))
    corrected = corrected_archive(retry_elites(condition, elites))
    n_cells = condition.archive.n_cells
    assert f"{elites.height} of {n_cells} cells are filled" in drawn.caption
    assert f"{elites['fitness'].sum() / n_cells:.3f}. By 64 fresh trials" in drawn.caption
    assert f"{corrected.height} cells with {corrected['again_fitness'].sum() / n_cells:.3f}" in drawn.caption
    assert "SIM, n = 1 run" in drawn.caption
    assert "mean of 2 runs" in drawn.caption
    assert drawn.in_width(NARROW).svg != drawn.svg
    shown = _map(condition, elites["cell"], elites["fitness"])
    assert np.nanmax(shown) == elites["fitness"].max()
    if name == "deep":
        assert shown.shape == (4, 3, 3)
        assert "differ only in mean_move" in drawn.caption
    else:
        assert np.isfinite(shown).sum() == elites.height


@pytest.mark.parametrize("name", ["flat", "deep", "spread"])
def test_a_click_on_a_cell_leads_to_its_elite(maps, name):
    condition = next(each for each in parse_study(STUDY, "maps.toml").conditions if each.name == name)
    tally = read_tally(maps)
    played = content(tally, "flat").trials[name]
    elites = elites_of(condition, maps.read(name, [tally.typical_replicate(name)]))
    assert played >= set(elites.select("generation", "individual").iter_rows())
    drawn = draw_elites(maps, name, played=played)
    fitness = {
        f"{row[0]}/{row[1]}": row[2]
        for row in elites.select("generation", "individual", "fitness").iter_rows()
    }
    found = [series for panel in drawn.marks if panel.axes.startswith("found") for series in panel.series]
    shown = _map(condition, elites["cell"], elites["fitness"])
    assert sum(len(each.points) for each in found) == np.isfinite(shown).sum()
    for series in found:
        assert series.n_linked == len(series.labels)
        assert series.link.startswith(f"#replay={name}/")
        for label, (x, y) in zip(series.labels, series.points, strict=True):
            assert f"{fitness[label]:.3f}" == series.name
            assert fitness[label] in shown[:, int(y), int(x)]
    without = draw_elites(maps, name, played=list(played)[:1]).marks
    assert sum(each.n_linked for panel in without for each in panel.series) <= 2


def test_the_fittest_elites_can_be_played_where_not_all_trials_fit(maps, monkeypatch):
    condition = next(each for each in parse_study(STUDY, "maps.toml").conditions if each.name == "deep")
    monkeypatch.setattr(_replay, "MOST_STEPS", 4 * 5 * (condition.on.steps + 1))
    tally = read_tally(maps)
    played = content(tally, "flat").trials["deep"]
    elites = elites_of(condition, maps.read("deep", [tally.typical_replicate("deep")]))
    best = elites.sort("fitness", descending=True, maintain_order=True).head(5)
    assert played == set(best.select("generation", "individual").iter_rows())


def test_a_view_and_the_report_show_it(maps, tmp_path):
    assert save_view(maps, tmp_path / "a.svg", subject="archive").read_text().startswith("<svg")
    html = write_report(maps).read_text("utf-8")
    assert len(re.findall('id="figure-elites-[012]"', html)) == 3


def test_mistakes_are_refused(maps, tmp_path):
    with pytest.raises(ValueError, match="'neat' has another selection than map-elites"):
        draw_elites(maps, "neat")
    with pytest.raises(ValueError, match="has no run 9"):
        draw_elites(maps, "flat", 9)
    with pytest.raises(ValueError, match="leave out generation"):
        save_view(maps, tmp_path / "a.svg", subject="archive", generation=1)


def test_a_study_without_archives_has_none(tiny_study):
    with pytest.raises(ValueError, match="No condition with runs has selection map-elites"):
        draw_elites(tiny_study)

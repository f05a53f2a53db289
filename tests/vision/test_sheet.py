"""Sheets are laid out, printed at true scale, and found on photographs."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from realitygap.errors import VisionError
from realitygap.vision import (
    SheetLayout,
    View,
    find_sheet,
    ink_density,
    read_photo,
    rectify,
    sheet_pdf,
    sheet_tiles,
)
from realitygap.vision._pixels import to_meters
from realitygap.world import Arena, Grid, Pose, load_arena

from .sheets import LAYOUT, ORDINARY, SCAN, curve, photo


def _box_arena(width, depth, grid):
    corners = [(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)]
    walls = tuple((*corners[k], *corners[(k + 1) % 4]) for k in range(4))
    return Arena("box", walls, grid, Pose(0.1, 0.1, 0.0))


def test_tags_and_boxes_lie_in_the_ring_where_no_pen_comes():
    grid = LAYOUT.grid
    left, lower = grid.x, grid.y
    right, upper = left + grid.columns * grid.cell, lower + grid.rows * grid.cell
    for tag in LAYOUT.tag_corners():
        assert ((tag[:, 0] < left) | (tag[:, 0] > right)).all()
        assert ((tag[:, 1] < lower) | (tag[:, 1] > upper)).all()
    boxes = LAYOUT.key_boxes()
    assert len(boxes) == 8
    for one, other in pairwise(boxes):
        assert other[0] > one[2]
        assert one[3] < lower
    tags = LAYOUT.tag_corners()
    assert boxes[0][0] > tags[0, :, 0].max()
    assert boxes[-1][2] < tags[1, :, 0].min()


def test_tags_and_boxes_lie_around_cells_that_reach_the_walls():
    layout = SheetLayout.of(_box_arena(0.6, 0.4, Grid(0.0, 0.0, 0.1, 6, 4)))
    assert not layout.is_ring_free
    for tag in layout.tag_corners():
        assert ((tag[:, 0] < 0) | (tag[:, 0] > 0.6)).all()
    assert all(box[3] < 0 for box in layout.key_boxes())
    left, lower, right, upper = layout.paper
    corners = layout.tag_corners().reshape(-1, 2)
    assert (corners > (left, lower)).all()
    assert (corners < (right, upper)).all()


def test_an_arena_too_small_for_tags_is_refused():
    with pytest.raises(ValueError, match=r"expected at least 0.18 m each way"):
        SheetLayout.of(_box_arena(0.1, 0.1, Grid(0.0, 0.0, 0.05, 2, 2)))


@pytest.mark.parametrize("name", ["paper", "maze-medium"])
def test_every_arena_of_a_certain_size_has_a_sheet(name):
    assert SheetLayout.of(load_arena(name)).key_boxes()


@pytest.mark.parametrize(
    ("paper", "short", "long"), [("a4", 210, 297), ("letter", 215.9, 279.4), ("a3", 297, 420)]
)
def test_pages_have_their_size_and_together_the_whole_sheet(paper, short, long):
    tiles = sheet_tiles(LAYOUT, paper)
    data = sheet_pdf(LAYOUT, paper)
    boxes = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", data)
    assert len(boxes) == len(tiles)
    for width, height in boxes:
        sides = sorted(float(side) / 72 * 25.4 for side in (width, height))
        assert sides == pytest.approx([short, long], abs=0.1)
    area = sum((t.box[2] - t.box[0]) * (t.box[3] - t.box[1]) for t in tiles)
    left, lower, right, upper = LAYOUT.paper
    assert area == pytest.approx((right - left) * (upper - lower))
    for tile in tiles:  # with the bleed and what no printer reaches it fits
        sides = sorted((tile.box[2] - tile.box[0], tile.box[3] - tile.box[1]))
        assert sides[0] <= short / 1000 - 0.028 + 1e-9
        assert sides[1] <= long / 1000 - 0.028 + 1e-9


def test_one_page_is_as_large_as_the_sheet():
    ((width, height),) = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", sheet_pdf(LAYOUT, "arena"))
    left, lower, right, upper = LAYOUT.paper
    assert float(width) / 72 * 0.0254 == pytest.approx(right - left, abs=1e-4)
    assert float(height) / 72 * 0.0254 == pytest.approx(upper - lower, abs=1e-4)


def test_unknown_paper_is_refused_with_a_hint():
    with pytest.raises(VisionError, match="Did you mean 'a4'"):
        sheet_tiles(LAYOUT, "a44")


def test_printed_tags_and_grids_have_their_true_scale(tmp_path):
    """The PDF's own drawing, as pixels: tags and grid are where the layout says."""
    import cv2
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from realitygap.vision._print import Tile, _page

    tile = Tile(LAYOUT.paper, 0, 0)
    figure = _page(LAYOUT, [*LAYOUT.outer_marks(), *LAYOUT.thin_marks()], tile, "arena", [tile])
    figure.set_dpi(80)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3])
    image = cv2.copyMakeBorder(image, 60, 60, 60, 60, cv2.BORDER_CONSTANT, value=(90, 90, 90))
    sheet = find_sheet(image, LAYOUT)
    px_per_m = 80 / 0.0254
    left, lower, right, upper = LAYOUT.paper
    points = np.array([(left, upper), (right, lower), (0.5, 0.3)])
    expected = np.column_stack([points[:, 0] - left, upper - points[:, 1]]) * px_per_m + 59.5
    assert sheet.to_photograph(points) == pytest.approx(expected, abs=1.5)
    assert sheet.grid_error < 0.0003


def test_a_view_is_the_same_after_being_told_in_numbers():
    view = View(np.array([[900.0, 20, 100], [-10, -950, 1900], [0.02, 0.01, 1]]), -0.05, 0.01, 4000, 3000)
    again = View.from_numbers(view.numbers(), 4000, 3000)
    points = np.random.default_rng(1).uniform(0, 1, (20, 2))
    assert again(points) == pytest.approx(view(points), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_drawn_line_lies_where_it_was_drawn(seed):
    """Perspective, lens and waves of the paper are taken out to within a millimeter."""
    image = read_photo(photo(seed, ORDINARY, n=1, size=None).jpeg)
    sheet = find_sheet(image, LAYOUT)
    density = ink_density(rectify(image, sheet, 2000.0), LAYOUT, 2000.0)
    rows, columns = np.nonzero(np.linalg.norm(density, axis=2) > 1.5)
    seen = to_meters(np.column_stack([columns, rows]).astype(float), LAYOUT.paper, 2000.0)
    grid = LAYOUT.grid
    inside = (seen > (grid.x, grid.y)).all(axis=1) & (
        seen < (grid.x + grid.columns * grid.cell, grid.y + grid.rows * grid.cell)
    ).all(axis=1)
    line = curve(0)
    fine = np.column_stack([np.interp(np.linspace(0, 399, 8000), np.arange(400), line[:, k]) for k in (0, 1)])
    away, _ = cKDTree(fine).query(seen[inside])
    assert np.percentile(away, 95) < 0.002  # half of the line's width, and a millimeter
    assert np.mean(away) < 0.001


def test_the_lens_is_seen_by_the_grid():
    straight = find_sheet(read_photo(photo(1, SCAN).jpeg), LAYOUT)
    assert abs(straight.view.k1) < 0.01
    assert straight.grid_error < 0.0003
    assert straight.tag_error < 0.0005


def test_a_photo_without_a_tag_says_which_is_missing():
    image = read_photo(photo(1, SCAN).jpeg).copy()
    sheet = find_sheet(image, LAYOUT)
    column, row = sheet.to_photograph(LAYOUT.tag_corners()[2].mean(axis=0)).astype(int)
    image[row - 150 : row + 150, column - 150 : column + 150] = 128
    with pytest.raises(VisionError, match="3 were found; missing: upper right"):
        find_sheet(image, LAYOUT)


def test_a_sheet_of_another_arena_is_told():
    other = SheetLayout.of(_box_arena(0.6, 0.6, Grid(0.0, 0.0, 0.1, 6, 6)))
    with pytest.raises(VisionError, match="not where this sheet has them"):
        find_sheet(read_photo(photo(1, SCAN).jpeg), other)

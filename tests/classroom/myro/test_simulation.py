"""The simulated robot, and how it is shown."""

import importlib
import math
import sys
import time
import xml.etree.ElementTree as ElementTree

import pytest

from realitygap.classroom import myro
from realitygap.classroom.myro import MyroError, _robot, _view


def open_sim(**options):
    myro.initialize("sim", **({"speed": "off"} | options))
    return _robot.robot_or_none().simulation


def test_a_simulated_robot_is_a_scribbler_2_with_a_fluke_2():
    simulation = open_sim()
    assert myro.getInfo("robot", "fluke") == ["Scribbler2", "3.0.5"]
    assert simulation.seed == 0
    assert simulation.arena.name == "paper"


def test_it_drives_ahead_from_its_start_at_the_scribblers_speed():
    simulation = open_sim()
    start = simulation.pose()
    myro.forward(1, 2)
    end = simulation.pose()
    assert end.x - start.x == pytest.approx(2 * 0.15, rel=0.15)
    assert end.y == pytest.approx(start.y)
    assert simulation.cells()[0] == 13
    assert len(simulation.cells()) == pytest.approx((end.x - start.x) / 0.0762, abs=1.5)
    assert simulation.coverage() == len(simulation.cells()) / 72
    assert simulation.path().shape[1] == 4


def test_the_same_seed_gives_the_same_run_and_another_one_another():
    def run(seed):
        simulation = open_sim(seed=seed, start="random")
        lights = [myro.getLight() for _ in range(3)]
        return simulation.pose(), lights

    assert run(5) == run(5)
    assert run(5)[0] != run(6)[0]
    assert run(5)[1] != run(6)[1]


def test_another_seed_is_other_noise_at_the_same_place():
    def lights(seed):
        open_sim(seed=seed, start="center")
        return [myro.getLight() for _ in range(3)]

    assert lights(5) == lights(5)
    assert lights(5) != lights(6)


@pytest.mark.parametrize("seed", range(20))
def test_a_start_by_chance_touches_no_wall(seed):
    pose = open_sim(seed=seed, start="random").pose()
    assert 0.12 < pose.x < 42 * 0.0254 - 0.12
    assert 0.12 < pose.y < 24 * 0.0254 - 0.12


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        ("center", (21 * 0.0254, 12 * 0.0254, 0)),
        ("0.5,0.3,90", (0.5, 0.3, math.pi / 2)),
        ((0.5, 0.3, -90), (0.5, 0.3, -math.pi / 2)),
    ],
)
def test_it_starts_where_it_should(start, expected):
    pose = open_sim(start=start).pose()
    assert tuple(pose) == pytest.approx(expected)


def test_options_come_behind_a_question_mark_too():
    myro.init("sim?seed=4&speed=off&model=s1&fluke=none&start=center")
    assert myro.getInfo("robot") == "Scribbler"
    myro.simulator(None, speed="off", fluke=1)
    assert myro.getInfo("fluke").startswith("2.")
    assert myro.SimScribbler(speed="off").simulation.seed == 0
    assert myro.makeRobot("SimScribbler").simulation.speed == 1


def test_a_second_takes_a_second_in_real_time_and_a_tenth_at_ten_times_the_speed():
    open_sim(speed=10)
    begun = time.monotonic()
    myro.forward(1, 5)
    assert 0.5 <= time.monotonic() - begun < 30  # the machine may be busy


def test_a_custom_arena_has_lamps_and_tape(tmp_path):
    arena = tmp_path / "lamp.toml"
    arena.write_text(
        "walls = [[0, 0, 2, 0], [2, 0, 2, 2], [2, 2, 0, 2], [0, 2, 0, 0]]\nstart = [1, 0.5, 0]\n"
        "lamps = [[1.8, 1.8, 2.0]]\ntape = [[1.3, 0, 1.3, 2]]\n"
        "[grid]\nx = 0\ny = 0\ncell = 0.25\ncolumns = 8\nrows = 8\n"
    )
    simulation = open_sim(arena=str(arena))
    myro.setForwardness("scribbler-forward")
    assert simulation.arena.grid.n_cells == 64
    simulation.witness.place((1.0, 0.5, 0.0), 1)
    left, _, right = myro.getLight()
    assert left < right  # the lamp is ahead to the left; bright is low
    while myro.getLine() == [0, 0]:
        myro.forward(0.3, 0.1)
        assert simulation.pose().x < 1.5
    assert simulation.pose().x == pytest.approx(1.25, abs=0.06)


# shown


def test_a_simulation_prints_as_a_map_of_letters():
    simulation = open_sim(start="center")
    myro.forward(1, 1)
    lines = str(simulation).splitlines()
    assert lines[-1].endswith("of 72 cells visited")
    assert any("→" in line and "·" in line for line in lines)
    assert lines[0].strip() == "#" * len(lines[0].strip())


def test_a_picture_of_arena_line_and_robot_is_well_formed():
    simulation = open_sim(start="center")
    myro.motors(0.5, 1)
    myro.wait(2)
    svg = _view.to_svg(simulation)
    ElementTree.fromstring(svg)
    assert f"has visited {len(simulation.cells())} of 72 cells" in svg


def test_a_line_is_drawn_with_a_point_a_centimeter():
    points = [(k / 1000, 0.0) for k in range(1000)]
    thin = _view.thinned(points)
    assert 90 <= len(thin) <= 102
    assert (thin[0], thin[-1]) == (points[0], points[-1])
    assert _view.thinned([]) == []


class Shell:
    """What IPython is to us in a notebook."""

    kernel = object()


@pytest.fixture
def screen(monkeypatch):
    """What a notebook shows, picture after picture."""
    shown = []
    monkeypatch.setattr(_view, "notebook_shell", Shell)
    monkeypatch.setattr(_view, "_screen", lambda svg: shown.append(svg) or shown.append)
    return shown


def test_a_notebook_shows_the_robot_as_it_drives_without_being_asked(screen):
    open_sim(speed=20, start="center")
    myro.turnLeft(0.5)
    until = time.monotonic() + 60  # a busy machine draws late
    while len(screen) < 4 and time.monotonic() < until:
        time.sleep(0.05)
    myro.stop()
    assert len(screen) >= 4
    assert len(set(screen)) >= 3


def test_a_notebook_shows_a_robot_without_a_clock_of_its_own_whenever_the_program_waits(screen, monkeypatch):
    monkeypatch.setattr(_view, "_PERIOD_S", 0.0)
    open_sim(start="center")
    before = len(screen)
    myro.forward(0.5, 1)
    myro.wait(1)
    assert len(screen) > before
    robot = _robot.robot_or_none()
    robot.close()
    last = len(screen)
    assert "visited" in screen[-1]
    time.sleep(0.05)
    assert len(screen) == last


def test_a_robot_that_stands_is_not_drawn_again(screen):
    open_sim(speed=20, start="center")
    time.sleep(0.5)
    assert len(screen) == 1


def test_the_view_can_be_switched_off(screen):
    open_sim(view="off")
    myro.forward(1, 1)
    assert screen == []
    with pytest.raises(MyroError, match="the view is 'tv'"):
        open_sim(view="tv")


def test_anywidget_gets_each_picture(monkeypatch):
    shown = []
    display = importlib.import_module("IPython.display")
    monkeypatch.setattr(display, "display", lambda thing, **_: shown.append(thing))
    put = _view._screen("<svg>1</svg>")
    put("<svg>2</svg>")
    assert shown[0].svg == "<svg>2</svg>"
    assert "innerHTML" in str(shown[0]._esm)


def test_a_drawing_is_replaced_without_anywidget(monkeypatch):
    updates = []

    class Handle:
        def update(self, thing):
            updates.append(thing.data)

    display = importlib.import_module("IPython.display")
    monkeypatch.setattr(display, "display", lambda thing, **_: updates.append(thing.data) or Handle())
    monkeypatch.setitem(sys.modules, "anywidget", None)
    _view._screen("<svg>1</svg>")("<svg>2</svg>")
    assert updates == ["<svg>1</svg>", "<svg>2</svg>"]


def test_pictures_are_shown_below_the_cell_in_a_notebook(monkeypatch):
    from realitygap.classroom.myro import _show

    shown = []
    display = importlib.import_module("IPython.display")
    monkeypatch.setattr(_show, "notebook_shell", Shell)

    class Handle:
        def update(self, thing):
            shown.append(("again", thing.data[:4]))

    monkeypatch.setattr(
        display, "display", lambda thing, **_: shown.append(("new", thing.data[:4])) or Handle()
    )
    _show.forget_cells()
    picture = myro.makePicture(2, 2)
    myro.show(picture)
    myro.show(picture)
    _show.forget_cells()
    myro.show(picture)
    assert [what for what, _ in shown] == ["new", "again", "new"]
    assert picture._repr_png_()[:4] == b"\x89PNG"
    _show.forget_cells()

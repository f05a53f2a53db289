"""Robots from files: those that come with realitygap, names of numbers, and mistakes."""

import json
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from realitygap.drawing import picture_of
from realitygap.errors import DescriptionError
from realitygap.kernels.sim.shape import SENSOR_NUMBERS, make_sim_shape, sim_rows
from realitygap.platforms import JyroPlatform
from realitygap.world import SENSORS, Distribution, RobotModel, load_robot, robot_names

from .outcomes import made_or_told

SMALL = """
[drive]
speed = 0.1
track = 0.05
[[body]]
radius = 0.03
"""


@pytest.fixture(name="write")
def _write(tmp_path):
    def write(text, name="mine.toml"):
        file = tmp_path / name
        file.write_text(text)
        return file

    return write


@pytest.mark.parametrize("name", robot_names())
def test_every_robot_loads_and_survives_the_trip_through_json(name):
    robot = load_robot(name)
    assert robot.name == name
    assert robot.description
    assert robot.sources
    again = RobotModel.from_dict(json.loads(json.dumps(robot.to_dict())))
    assert again.numbers() == robot.numbers()
    assert again.to_dict() == robot.to_dict()


def test_the_issue_s_robots_are_there():
    scribblers = {
        f"scribbler-{model}{board}{box}"
        for model in ("s1", "s2", "s3")
        for board in ("", "-fluke1", "-fluke2")
        for box in ("", "-cardboard")
    }
    assert set(robot_names()) == scribblers | {
        "jyro",
        "pioneer",
        "khepera",
        "e-puck",
        "thymio",
        "thymio-playground",
        "create3",
        "epuck2",
        "turtlebot3-burger",
        "turtlebot4",
    }


def test_jyro_is_what_the_platform_jyro_drives():
    robot, platform = load_robot("jyro"), JyroPlatform()
    assert set(robot.body[0].corners) == set(platform.body.corners)
    assert [(s.x, s.y, s.direction, s.reach) for s in robot.range] == [
        (*mount, platform.sensors.max_range) for mount in platform.sensors.mounts
    ]
    assert (robot.contact.model, robot.drive.mixing, robot.step_s) == ("freeze", "independent", 0.1)
    assert (robot.drive.speed, robot.drive.turn_rate) == (platform.speed, platform.turn_rate)


def test_the_scribbler_has_its_firmware_s_figures():
    robot = load_robot("scribbler-s2-fluke2")
    assert (robot.drive.speed, robot.drive.track, robot.step_s) == (0.15, 0.153, 0.5)
    points = np.array(robot.body[0].outline())
    assert np.ptp(points, axis=0) == pytest.approx([0.178, 0.159], abs=5e-4)
    assert len(robot.body[0].corner) >= 8
    assert robot.body[0].radius > 0


def test_the_other_end_is_ahead_with_a_fluke():
    alone, with_fluke = load_robot("scribbler-s2"), load_robot("scribbler-s2-fluke2")
    assert alone.looks.caster[0] < 0 < with_fluke.looks.caster[0]
    assert with_fluke.stall.idler == -alone.stall.idler > 0
    for a, b in zip(alone.light, with_fluke.light, strict=True):
        assert (b.x, b.y) == (-a.x, -a.y)
        assert math.cos(b.direction - a.direction) == pytest.approx(-1)
    assert all(sensor.x > 0 for sensor in with_fluke.range)
    turned = [(-x, -y) for x, y in alone.body[0].corners]
    assert list(with_fluke.body[0].corners) == turned


@pytest.mark.parametrize("name", ["scribbler-s1", "scribbler-s2-fluke1", "scribbler-s3-fluke2"])
def test_cardboard_holds_the_robot(name):
    bare, boxed = load_robot(name), load_robot(f"{name}-cardboard")
    points, box = np.array(bare.body[0].outline()), np.array(boxed.body[0].corners)
    assert (points.max(0) < box.max(0)).all()
    assert (points.min(0) > box.min(0)).all()
    assert boxed.range == bare.range
    assert boxed.drive == bare.drive


def test_names_of_numbers_are_those_of_the_kernels():
    """So a name of a kind of sensor is the same in `RobotModel`, `SENSORS`, and the kernels, and each is drawn."""
    assert tuple(SENSORS) == tuple(SENSOR_NUMBERS)
    kinds = {kind: [dict.fromkeys(numbers, 0.02)] for kind, numbers in SENSOR_NUMBERS.items()}
    robot = RobotModel.from_dict({**load_robot("e-puck").to_dict(), **kinds, "encoder": {}})
    assert all(f"1 {kind} sensor" in picture_of(robot).to_svg() for kind in SENSORS)
    shape = make_sim_shape(
        parts=[len(part.corner) for part in robot.body],
        range_response=[sensor.response for sensor in robot.range],
        sensors={kind: len(sensors) for kind, sensors in robot.sensors.items()},
        encoders=True,
    )
    theirs = {name for name in sim_rows(shape) if not name.startswith("arena.")}
    assert theirs == set(robot.numbers())


def test_a_distribution_in_a_number_s_place_varies(write):
    robot = load_robot(write(SMALL.replace("0.05", '{ normal = [0.05, 0.01], least = 0.02, per = "run" }')))
    assert robot.drive.track == 0.05
    assert robot.numbers()["drive.track"] == Distribution(normal=(0.05, 0.01), least=0.02, per="run")
    assert RobotModel.from_dict(robot.to_dict()) == robot
    fixed = robot.with_numbers({"drive.track": 0.06, "body.0.radius": {"uniform": [0.02, 0.03]}})
    assert fixed.numbers()["drive.track"] == 0.06
    assert set(fixed.vary) == {"body.0.radius"}


def test_a_normal_distribution_keeps_the_number_s_limits(write):
    robot = load_robot(write(SMALL + "[contact]\nfriction = { normal = [0.1, 0.5] }\n"))
    drawn = robot.vary["contact.friction"].of(np.linspace(0, 1, 1001)[:-1])
    assert drawn.min() == 0.0


def test_units_at_the_end_of_a_key(write):
    text = SMALL + "[[range]]\nx_mm = 25.4\ny_in = 1\ndirection_deg = 90\nreach_cm = { uniform = [10, 20] }\n"
    robot = load_robot(write(text))
    (sensor,) = robot.range
    assert (sensor.x, sensor.y) == pytest.approx((0.0254, 0.0254))
    assert sensor.direction == pytest.approx(math.pi / 2)
    assert robot.vary["range.0.reach"].uniform == pytest.approx((0.1, 0.2))


def test_each_is_put_into_every_entry_and_base_below(write):
    write(
        SMALL + "[each.range]\nreach = 0.3\n[[range]]\nx = 0\ny = 0\n[[range]]\nx = 0\ny = 0\nreach = 0.4\n"
    )
    robot = load_robot(write('base = "mine.toml"\n[drive]\nspeed = 0.2\n', "other.toml"))
    assert [sensor.reach for sensor in robot.range] == [0.3, 0.4]
    assert (robot.name, robot.drive.speed, robot.drive.track) == ("other", 0.2, 0.05)


def test_each_without_entries_is_put_over_every_entry_of_the_base(write):
    sensors = "[[range]]\nx = 0\ny = 0\nreach = 0.3\n[[range]]\nx = 0.02\ny = 0\nreach = 0.4\n"
    write(SMALL + sensors)
    robot = load_robot(write('base = "mine.toml"\n[each.range]\nreach_mm = 250\n', "other.toml"))
    assert [(sensor.x, sensor.reach) for sensor in robot.range] == [(0, 0.25), (0.02, 0.25)]
    with pytest.raises(
        DescriptionError, match=r"\[each.line\] is only for \[\[line\]\], of which there are none"
    ):
        load_robot(write('base = "mine.toml"\n[each.line]\nnoise = 0.1\n', "third.toml"))
    with pytest.raises(DescriptionError, match=r"each.range is 3, expected a table \[each.range\]"):
        load_robot(write('base = "mine.toml"\n[each]\nrange = 3\n', "fourth.toml"))


def test_thymio_of_the_playground_differs_by_what_its_rays_keep():
    robot, real = load_robot("thymio-playground"), load_robot("thymio")
    assert all(sensor.keeps_edge for sensor in robot.range)
    assert robot.numbers() == real.numbers()
    assert RobotModel.from_dict(robot.to_dict()).range == robot.range
    assert "keeps_edge" not in real.to_dict()["range"][0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (SMALL.replace("0.1", '"fast"'), "drive.speed: expected a number, got 'fast'."),
        (SMALL.replace("0.1", "-1"), "drive.speed: expected more than 0"),
        (SMALL.replace("0.1", "nan"), "drive.speed: expected a finite number"),
        (SMALL.replace("speed", "sped"), "drive.sped: unknown setting. Did you mean 'speed'?"),
        (SMALL.replace("0.1", "{ uniform = [-1, 3] }"), "drive.speed: expected numbers more than 0"),
        (SMALL.replace("0.1", "{ normal = [1, 1] }"), "drive.speed: a normal distribution reaches 0"),
        (SMALL.replace("0.1", "{ uniform = [2, 1] }"), "drive.speed: expected uniform = [lower, upper]"),
        (SMALL + "[vary]\n'drive.trak' = { uniform = [1, 2] }\n", "Did you mean 'drive.track'?"),
        (
            "step_s = { uniform = [0.4, 0.6] }\n" + SMALL,
            "step_s: expected a number, got {'uniform': [0.4, 0.6]}",
        ),
        (
            "contact = { model = { choice = [1, 2] } }\n" + SMALL,
            "contact.model: expected 'freeze', 'stop' or 'slide', got {'choice': [1, 2]}",
        ),
        (
            SMALL + "[vary]\n'step_s' = { uniform = [1, 2] }\n",
            "step_s: the same in all trials, and no number",
        ),
        (SMALL + "[[range]]\nx = 0\ny = 0\nreach = 1\n[[range]]\nx = 0\ny = 0\n", "range.1.reach: missing"),
        (
            SMALL + "[[range]]\nx = 0\ny = 0\nreach = 1\nrays = 2\n",
            "range.0: rays is 2, expected an odd number",
        ),
        (SMALL + "[[range]]\nx = 0\ny = 0\nreach = 1\nresponse = 'table'\n", "at least 2 rows"),
        (SMALL + "track_mm = 3\n", "body.0.track: unknown setting"),
        (SMALL.replace("track", "track_mm = 3\ntrack"), "drive.track: given twice"),
        (
            SMALL.replace("radius = 0.03", "corner = [[0, 0], [0, 1], [1, 1]]"),
            "body.0: its corners go clockwise",
        ),
        (
            SMALL.replace("radius = 0.03", "corner = [[0, 0], [1, 0], [0.2, 0.2], [0, 1]]"),
            "body.0: it is not convex: corner 2, at (0.2, 0.2), points inwards",
        ),
        (
            SMALL.replace(
                "radius = 0.03", "corner = [[0, 1], [-0.6, -0.8], [1, 0.3], [-1, 0.3], [0.6, -0.8]]"
            ),
            "body.0: it is no outline",
        ),
        (SMALL.replace("radius = 0.03", "corner = [[0, 0], [0, 0], [1, 1]]"), "corners 0 and 1 are the same"),
        (SMALL.replace("radius = 0.03", "box = [1, 1]\nradius = 0.6"), "at least twice the radius"),
        (SMALL.replace("radius = 0.03", "radius = 0"), "body.0: expected a radius of more than 0"),
        (SMALL.replace("radius = 0.03", "radius = -1"), "body.0.radius: expected at least 0"),
        ("[[body]]\nradius = 1", "drive: missing"),
        ("body = []\n" + SMALL.replace("[[body]]\nradius = 0.03", ""), "body: expected at least 1, got 0"),
        ('base = "mine.toml"', "`base` leads back to it"),
        ('base = "scribler-s2"', "Did you mean 'scribbler-s2'?"),
        ("turned = true", "base is None"),
        ("[drive", "not TOML"),
        ("a = " + "[" * 5000, "too deep"),
        ("[each.light]\nx = 1\n" + SMALL, "[each.light] is only for [[light]]"),
    ],
)
def test_a_mistake_gets_its_place_and_our_words(write, text, says):
    file = write(text)
    with pytest.raises(DescriptionError) as caught:
        load_robot(file)
    assert says in str(caught.value)
    assert "pydantic" not in str(caught.value)


def test_all_mistakes_are_told_at_once(write):
    with pytest.raises(DescriptionError, match="has 3 mistakes") as caught:
        load_robot(write(SMALL.replace("0.1", "-1").replace("0.05", "[]") + "foo = 1\n"))
    assert len(str(caught.value).split("\n")) == 4


def test_a_huge_file_is_not_read(tmp_path):
    file = tmp_path / "huge.toml"
    file.write_bytes(b"#" * 5_000_000)
    with pytest.raises(DescriptionError, match="larger than 4,000,000 bytes"):
        load_robot(file)


def test_robot_files_that_are_no_text_are_refused(tmp_path):
    file = tmp_path / "binary.toml"
    file.write_bytes(b"name = '\xff'")
    with pytest.raises(DescriptionError, match="not a text file in UTF-8"):
        load_robot(file)
    with pytest.raises(DescriptionError, match="There is no robot file"):
        load_robot(tmp_path / "none.toml")
    with pytest.raises(TypeError, match="expected the name of one"):
        load_robot(3)


VALUES = st.recursive(
    st.one_of(
        st.integers(-(10**20), 10**20), st.floats(), st.booleans(), st.text(max_size=5), st.just("slide")
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(
            st.sampled_from(
                ["x", "y_mm", "corner", "box", "radius", "uniform", "normal", "least", "reach", "q"]
            ),
            inner,
            max_size=4,
        ),
    ),
    max_leaves=12,
)
KEYS = st.sampled_from(
    ["name", "body", "drive", "range", "contact", "vary", "light", "step_s", "looks", "encoder"]
)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.dictionaries(KEYS, VALUES, max_size=5))
def test_whatever_values_come_there_is_a_robot_or_a_message(values):
    whole = {"body": [{"radius": 0.1}], "drive": {"speed": 1, "track": 1}, "name": "x", **values}
    robot = made_or_told(lambda: RobotModel(**whole))
    assert robot, "a mistake is told in words"
    if not isinstance(robot, str):
        assert RobotModel.from_dict(robot.to_dict()).numbers() == robot.numbers()


LORENTZ = """
[[range]]
x = 0.03
y = 0
reach = 0.14
cone_deg = 15
rays = 3
response = "lorentz"
half_width_mm = 85
peak_mm = 0.3
"""


def test_a_lorentz_sensor_keeps_its_numbers_and_others_do_not_have_them(write):
    robot = load_robot(write(SMALL + LORENTZ))
    assert (robot.range[0].half_width, robot.range[0].peak) == (0.085, 0.0003)
    assert RobotModel.from_dict(robot.to_dict()) == robot
    assert robot.to_dict()["range"][0]["half_width"] == 0.085
    fitted = robot.with_numbers({"range.0.half_width": 0.08, "range.0.peak": {"normal": [0.0, 0.001]}})
    assert fitted.numbers()["range.0.half_width"] == 0.08
    for name in ("khepera", "scribbler-s2-fluke2", "pioneer"):
        assert "half_width" not in load_robot(name).to_dict()["range"][0]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("rays = 3", "rays = 5", "rays is 5, expected 1 or 3 with response 'lorentz'"),
        ("cone_deg = 15", "cone_deg = 90", "expected less than pi / 2"),
        ("peak_mm = 0.3", "peak_mm = 85", "peak is 0.085, expected less than half_width, 0.085"),
        ("half_width_mm = 85", "half_width_mm = 0", "more than 0"),
        (
            'response = "lorentz"',
            "keeps_edge = true",
            "keeps_edge is true, expected false with response 'linear'",
        ),
    ],
)
def test_a_lorentz_sensor_that_cannot_be_is_refused(write, old, new, expected):
    with pytest.raises(DescriptionError, match=expected.replace("(", r"\(")):
        load_robot(write(SMALL + LORENTZ.replace(old, new)))


def test_the_thymio_has_enkis_outline_and_sensors():
    robot = load_robot("thymio")
    corners = np.array(robot.body[0].corners)
    assert corners.max(0) == pytest.approx([0.08, 0.055])
    assert corners.min(0) == pytest.approx([-0.03, -0.055])
    front = corners[corners[:, 0] > 0.05]
    assert np.hypot(*front.T) == pytest.approx(np.full(len(front), 0.08), abs=1e-5)
    assert (len(robot.range), len(robot.line), robot.encoder is not None) == (7, 2, True)
    mirrored = [(s.x, -s.y, -s.direction % math.tau) for s in robot.range]
    pairs = {0: 4, 1: 3, 2: 2, 5: 6}
    for left, right in pairs.items():
        sensor = robot.range[right]
        assert mirrored[left] == pytest.approx((sensor.x, sensor.y, sensor.direction % math.tau))
    assert {(s.response, s.rays, s.half_width) for s in robot.range} == {("lorentz", 3, 0.08544)}
    assert robot.range[0].half_width ** 2 == pytest.approx(73e-4, abs=1e-6)
    assert robot.drive.speed == pytest.approx(300 * 0.00033)

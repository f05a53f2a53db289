"""Maps of ROS become arenas, and arenas become maps that map_server reads."""

import math

import numpy as np
import pytest
from PIL import Image

from realitygap.errors import DescriptionError
from realitygap.vision import _ros_map, arena_of_map, read_map, save_map
from realitygap.world import Arena, Grid, Obstacle, Pose, arena_names, is_inside, load_arena, paper_arena

PIXEL = 0.05


def write_map(folder, gray, *, ending=".pgm", **values):
    """A map with this picture, row 0 at the top; its YAML file."""
    Image.fromarray(np.asarray(gray, np.uint8)).save(folder / f"room{ending}")
    told = {"image": f"room{ending}", "resolution": PIXEL, "origin": [-1.0, 2.0, 0.0]} | values
    told = {"negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196} | told
    (folder / "room.yaml").write_text(
        "\n".join(f"{key}: {value}" for key, value in told.items() if value is not None)
    )
    return folder / "room.yaml"


def room(height=40, width=60):
    """A room 2 m high and 3 m wide with walls one pixel thick, around them unknown."""
    gray = np.full((height, width), 205)
    gray[2:-2, 2:-2] = 0
    gray[3:-3, 3:-3] = 254
    return gray


def corners(arena):
    return {(round(x, 4), round(y, 4)) for wall in arena.walls for x, y in (wall[:2], wall[2:])}


LEFT, RIGHT, BOTTOM, TOP = -1 + 3 * PIXEL, -1 + 57 * PIXEL, 2 + 3 * PIXEL, 2 + 37 * PIXEL


@pytest.mark.parametrize("ending", [".pgm", ".png"])
def test_a_room_has_four_walls_where_its_free_space_ends(tmp_path, ending):
    arena = arena_of_map(write_map(tmp_path, room(), ending=ending))
    assert arena.name == "room"
    assert len(arena.walls) == 4
    assert corners(arena) == {(round(x, 4), round(y, 4)) for x in (LEFT, RIGHT) for y in (BOTTOM, TOP)}
    assert is_inside(arena, arena.start.x, arena.start.y)
    assert arena.start.y == pytest.approx((BOTTOM + TOP) / 2, abs=PIXEL)


def test_a_box_in_a_room_has_walls_and_free_places_out_of_reach_have_none(tmp_path):
    gray = room()
    gray[10:20, 20:30] = 0
    gray[0, 0] = 254  # free, and out of reach
    gray[14, 24] = 254  # within the box
    arena = arena_of_map(write_map(tmp_path, gray))
    box = {(round(-1 + c * PIXEL, 4), round(4 - r * PIXEL, 4)) for c in (20, 30) for r in (10, 20)}
    assert corners(arena) >= box
    assert len(arena.walls) == 8


def test_the_origin_moves_and_turns_the_room(tmp_path):
    arena = arena_of_map(write_map(tmp_path, room(), origin=[5.0, 1.0, math.pi / 2]))
    xs, ys = zip(*corners(arena), strict=True)
    assert (min(xs), max(xs)) == (pytest.approx(5 - 37 * PIXEL), pytest.approx(5 - 3 * PIXEL))
    assert (min(ys), max(ys)) == (pytest.approx(1 + 3 * PIXEL), pytest.approx(1 + 57 * PIXEL))


@pytest.mark.parametrize(
    ("free", "values", "is_free"),
    [
        (254, {}, True),
        (205, {}, False),
        (205, {"free_thresh": 0.25}, True),
        (0, {"negate": 1}, True),
        (254, {"negate": 1}, False),
        (0, {"negate": True}, True),
        (10, {"mode": "raw"}, True),
        (50, {"mode": "raw"}, False),
        (255, {"mode": "raw"}, False),
    ],
)
def test_a_pixel_is_free_as_its_file_says(tmp_path, free, values, is_free):
    found = read_map(write_map(tmp_path, [[free, free]], **values))
    assert found.free.tolist() == [[is_free, is_free]]


MODES = {
    "gray": (lambda g: g.astype(np.uint8), ".pgm"),
    "16 bits": (lambda g: (g * 257).astype(np.uint16), ".png"),
    "color": (lambda g: np.stack([g] * 3, -1).astype(np.uint8), ".png"),
    "fractions": (lambda g: (g / 255).astype(np.float32), ".tif"),
}


@pytest.mark.parametrize(("picture", "ending"), MODES.values(), ids=MODES)
def test_map_is_the_same_whatever_the_depth_of_its_image(tmp_path, picture, ending):
    path = write_map(tmp_path, room())
    expected = read_map(path).free
    assert expected.sum() == 34 * 54
    Image.fromarray(picture(room())).save(tmp_path / f"room{ending}")
    path.write_text(path.read_text().replace("room.pgm", f"room{ending}"))
    assert (read_map(path).free == expected).all()


def map_server_cell(red, green, blue, alpha, *, mean, negate, occupied, free):
    """One pixel as map_server reads it in mode trinary: 100, 0, or -1; `mean` is the gray of before Jazzy."""
    shade = (red + green + blue) / 3 if mean else 0.212656 * red + 0.715158 * green + 0.072186 * blue
    share = shade / 255 if negate else 1 - shade / 255
    if alpha is not None and alpha < 255:
        return -1
    return 100 if share > occupied else 0 if share < free else -1


@pytest.mark.parametrize("negate", [0, 1])
@pytest.mark.parametrize("kind", ["RGB", "RGBA"])
def test_pixel_is_free_only_if_both_versions_of_map_server_agree(tmp_path, kind, negate):
    rng = np.random.default_rng(3)
    pixels = rng.integers(160, 256, (30, 40, len(kind)))
    pixels = (255 - pixels if negate else pixels).astype(np.uint8)
    if kind == "RGBA":
        pixels[..., 3] = rng.choice([0, 100, 255], pixels.shape[:2])
    Image.fromarray(pixels).save(tmp_path / "colors.png")
    found = read_map(write_map(tmp_path, [[0]], image="colors.png", negate=negate)).free
    rule = {"negate": negate, "occupied": 0.65, "free": 0.196}
    expected = [
        [
            all(
                map_server_cell(*pixel, *[None] * (4 - len(pixel)), mean=mean, **rule) == 0
                for mean in (True, False)
            )
            for pixel in row
        ]
        for row in pixels.tolist()
    ]
    assert found.tolist() == expected
    assert 0 < found.sum() < found.size


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
def test_transparent_surroundings_are_unknown(tmp_path, mode):
    pixels = np.zeros((20, 20, 4), np.uint8)  # transparent, and black, which is free in mode raw
    pixels[..., :3] = 0 if mode == "raw" else 255
    pixels[5:15, 5:15, 3] = 255
    Image.fromarray(pixels).save(tmp_path / "clear.png")
    found = read_map(write_map(tmp_path, [[0]], image="clear.png", mode=mode)).free
    assert found.sum() == 100
    assert found[5:15, 5:15].all()


def test_gray_of_unknown_that_counts_as_free_gets_a_warning(tmp_path, recwarn):
    read_map(write_map(tmp_path, room()))
    assert not recwarn
    with pytest.warns(
        UserWarning, match=r"384 pixels of gray 205, .* count as free, because free_thresh is 0\.25"
    ):
        read_map(write_map(tmp_path, room(), free_thresh=0.25))


@pytest.mark.parametrize(
    ("key", "text", "expected"),
    [
        ("resolution", "5e-2", 0.05),
        ("resolution", "1e+0", 1.0),
        ("resolution", "+.5", 0.5),
        ("resolution", "010", 10.0),
        ("mode", "Trinary", None),
        ("negate", "False", None),
        ("origin", "[1e-05, -2.5e1, 0]", None),
    ],
)
def test_values_are_read_as_map_server_reads_them(tmp_path, key, text, expected):
    found = read_map(write_map(tmp_path, room(), **{key: text}))
    assert found.free.sum() == 34 * 54
    if expected is not None:
        assert found.resolution == expected
    if key == "origin":
        assert found.origin == Pose(1e-5, -25.0, 0.0)


def test_a_start_chooses_its_room(tmp_path):
    gray = room()
    gray[:, 20] = 0  # a wall between a small room and a large one
    path = write_map(tmp_path, gray)
    large, small = arena_of_map(path), arena_of_map(path, (-0.5, 3.0, 1.0))
    assert small.start == Pose(-0.5, 3.0, 1.0)
    assert max(x for x, _ in corners(small)) == pytest.approx(-1 + 20 * PIXEL)
    assert min(x for x, _ in corners(large)) == pytest.approx(-1 + 21 * PIXEL)


@pytest.mark.parametrize("angle", [0.1, 0.5, 0.785, 1.3])
def test_a_sloping_line_one_pixel_wide_is_straight_and_has_no_gap(tmp_path, angle):
    size = 1.0
    ends = [
        (size * math.cos(angle + k * math.pi / 2), size * math.sin(angle + k * math.pi / 2)) for k in range(4)
    ]
    walls = tuple((*ends[k], *ends[(k + 1) % 4]) for k in range(4))
    made = Arena("square", walls, Grid(-1, -1, 0.5, 4, 4), Pose(0, 0, 0))
    save_map(made, tmp_path / "square.yaml")
    again = arena_of_map(tmp_path / "square.yaml", made.start)
    assert len(again.walls) <= 8
    for x1, y1, x2, y2 in again.walls:
        for share in (0.0, 0.5, 1.0):
            x, y = x1 + share * (x2 - x1), y1 + share * (y2 - y1)
            turned = [
                abs(x * math.cos(a) + y * math.sin(a)) for a in (angle + math.pi / 4, angle - math.pi / 4)
            ]
            assert max(turned) == pytest.approx(size / math.sqrt(2), abs=0.035)


@pytest.mark.parametrize("name", ["paper", "maze-medium", "maze-hard", "paper-boxes"])
def test_an_arena_comes_back_from_its_map(tmp_path, name):
    made = load_arena(name)
    image = save_map(made, tmp_path / "map.yaml", resolution=0.005)
    again = arena_of_map(tmp_path / "map.yaml", made.start)
    assert Image.open(image).format == "PPM"
    assert again.start == made.start
    lines = np.array(made.segments)
    for x1, y1, x2, y2 in again.walls:
        for share in (0.0, 0.5, 1.0):
            point = np.array([x1 + share * (x2 - x1), y1 + share * (y2 - y1)])
            start, along = lines[:, :2], lines[:, 2:] - lines[:, :2]
            places = np.clip(((point - start) * along).sum(1) / (along**2).sum(1), 0, 1)
            assert np.linalg.norm(start + places[:, None] * along - point, axis=1).min() < 0.016
    lengths = [sum(math.dist(wall[:2], wall[2:]) for wall in walls) for walls in (made.segments, again.walls)]
    assert lengths[1] > 0.9 * lengths[0]


def test_a_map_shows_free_unknown_and_occupied_space(tmp_path):
    made = paper_arena()
    disc = Obstacle(0.6, 0.3, 0.0, ((0.0, 0.0),), 0.1)
    made = Arena("disc", made.walls, made.grid, made.start, (disc,))
    gray = np.array(Image.open(save_map(made, tmp_path / "map.yaml")))
    assert gray[0, 0] == 205
    assert set(np.unique(gray)) == {0, 205, 254}
    found = read_map(tmp_path / "map.yaml")
    column, row = found.to_image(0.6, 0.3)
    assert gray[row, column] == 0
    column, row = found.to_image(made.start.x, made.start.y)
    assert found.free[row, column]
    assert gray.shape == (61 + 1 + 8, 107 + 1 + 8)


@pytest.mark.parametrize("name", arena_names())
def test_an_arena_comes_back_from_its_file(tmp_path, name):
    text = load_arena(name).to_toml()
    (tmp_path / "again.toml").write_text(text)
    assert load_arena(tmp_path / "again.toml").to_toml() == text


WRONG = {
    "no map": (
        {"image": None},
        "it has no image, expected the YAML file of a map: image, resolution, and origin",
    ),
    "resolution": ({"resolution": 0}, "resolution: expected a number from 0.0001 to 1000, got 0"),
    "no number": ({"resolution": "wide"}, "resolution: expected a number from 0.0001 to 1000, got 'wide'"),
    "origin": ({"origin": 3}, r"origin: expected \[x, y, yaw\], got 3"),
    "origin's part": ({"origin": "[0, .nan, 0]"}, "origin: expected a number from -10000 to 10000, got nan"),
    "thresholds": ({"free_thresh": 0.9}, "free_thresh: expected less than occupied_thresh, 0.65, got 0.9"),
    "mode": ({"mode": "magic"}, "mode: expected trinary, scale, raw, got 'magic'"),
    "negate": ({"negate": 2}, "negate: expected a number from 0 to 1, got 2"),
    "image": ({"image": "other.pgm"}, "image: there is no file .*other.pgm"),
    "another folder": ({"image": "../room.pgm"}, "image: expected a plain file in the same folder"),
    "another place": ({"image": "/etc/hostname"}, "image: expected a plain file in the same folder"),
    "large": ({"resolution": 10**400}, "resolution: expected a number from 0.0001 to 1000, got"),
    "image's name": ({"image": 7}, "image: expected the name of a file, got 7"),
    "itself": ({"image": "room.yaml"}, "image: room.yaml is no image that can be read"),
}


@pytest.mark.parametrize(("values", "message"), WRONG.values(), ids=WRONG)
def test_a_wrong_value_has_one_message(tmp_path, values, message):
    with pytest.raises(DescriptionError, match=rf"room\.yaml: {message}"):
        read_map(write_map(tmp_path, room(), **values))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"image: [", "not YAML"),
        (b"\xff\xfe\x00", "not a YAML file of a map"),
        (
            b"image: a\norigin: [0x" + b"f" * 5000 + b"]\nresolution: 1",
            "a value has 5,002 letters, expected at most",
        ),
        (b"a: &a [1]\nimage: [*a, *a]\n", "it has references"),
        (b"- 1\n- 2\n", "it has no image, resolution, origin"),
        (b"!!python/object/apply:os.system ['touch owned']\n", "not YAML"),
    ],
)
def test_a_file_that_is_no_map_has_one_message(tmp_path, data, message):
    (tmp_path / "room.yaml").write_bytes(data)
    with pytest.raises(DescriptionError, match=message):
        read_map(tmp_path / "room.yaml")


def test_a_map_that_cannot_be_an_arena_has_one_message(tmp_path):
    with pytest.raises(DescriptionError, match=r"There is no map .*none\.yaml"):
        read_map(tmp_path / "none.yaml")
    with pytest.raises(DescriptionError, match="has no free pixel"):
        arena_of_map(write_map(tmp_path, np.zeros((5, 5))))
    with pytest.raises(DescriptionError, match=r"The start \(9, 9\) is not in free space"):
        arena_of_map(write_map(tmp_path, room()), (9, 9, 0))
    gray = np.full((99, 99), 254)
    gray[1::2, 1::2] = 0
    with pytest.raises(
        DescriptionError, match=r"has 9,\d+ walls with a tolerance of 0\.01 m, expected at most 2,048"
    ):
        arena_of_map(write_map(tmp_path, gray), tolerance=0.01)
    with pytest.raises(DescriptionError, match=r"would have .* pixels, expected at most 8,192 each way"):
        save_map(paper_arena(), tmp_path / "out.yaml", resolution=1e-4)
    with pytest.raises(DescriptionError, match="a wall covers the start"):
        save_map(paper_arena(), tmp_path / "out.yaml", resolution=1.0)


def test_map_of_noise_is_refused_before_it_is_traced(tmp_path, monkeypatch):
    monkeypatch.setattr(_ros_map, "_MOST_SPACES", 90)
    gray = room()
    gray[6:26:2, 6:26:2] = 0
    with pytest.raises(DescriptionError, match=r"has 10\d separate spaces, expected at most 90"):
        arena_of_map(write_map(tmp_path, gray))
    gray = np.zeros((40, 60))
    gray[6:26:2, 6:26:2] = 254
    with pytest.raises(DescriptionError, match="has 101 separate spaces, expected at most 90"):
        arena_of_map(write_map(tmp_path, gray))


def test_large_map_has_the_walls_of_a_small_one(tmp_path, monkeypatch):
    gray = room()
    gray[10:20, 20:30] = 0
    path = write_map(tmp_path, gray)
    expected = arena_of_map(path)
    monkeypatch.setattr(_ros_map, "_LARGE", 100)
    assert corners(arena_of_map(path)) == corners(expected)
    assert arena_of_map(path).start == expected.start

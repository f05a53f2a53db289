"""Pictures come out as the camera took them, from exactly these bytes."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.errors import ProtocolError, RobotError
from realitygap.families.scribbler import Blob, Scribbler, _images

from .peers import INFOS, ScriptedPort, greeting
from .pictures import counted, jpeg_parts, slope

PREPARE_1 = [
    (bytes([131, 18, 20]), b""),
    (bytes([131, 19, 163]), b""),
    (bytes([127, 0, 3, 0, 128, 191, 2, 1]), b""),
    (bytes([127, 1, 65, 0, 190, 191, 2, 1]), b""),
    (bytes([127, 2, 129, 0, 254, 191, 2, 1]), b""),
    (bytes([118, 90, 4, 0, 255, 51, 136, 190, 255]), b""),
]
PREPARE_2 = [
    (bytes([11, 213]), b""),
    *PREPARE_1[:2],
    (bytes([127, 0, 0, 3, 0, 0, 2, 128, 3, 31, 2, 1]), b""),
    (bytes([127, 1, 1, 65, 0, 0, 3, 190, 3, 31, 2, 1]), b""),
    (bytes([127, 2, 2, 129, 0, 0, 4, 254, 3, 31, 2, 1]), b""),
    PREPARE_1[-1],
]


def opened(setup: str, *script: tuple[bytes, bytes]) -> tuple[Scribbler, ScriptedPort]:
    prepare = PREPARE_2 if setup.endswith("2") else PREPARE_1
    port = ScriptedPort([*greeting(INFOS[setup]), *prepare, *script])
    return Scribbler(port), port


def test_the_camera_is_set_up_once_as_myro_does_and_left_in_peace_meanwhile():
    robot, port = opened("s2+fluke1", (bytes([95]), bytes([1, 2, 30, 40])), (bytes([95]), bytes(4)))
    assert robot.blob() == Blob(258, 30, 40)
    assert port.clock.now() == pytest.approx(0.3)  # twice 0.15 s for the registers
    assert robot.blob() == Blob(0, 0, 0)
    port.check_all_said()


def test_a_color_picture_of_a_fluke_1_is_stretched_to_its_full_width():
    half = np.repeat(slope(128, 192)[:, :, None], 3, axis=2)
    header, scan = jpeg_parts(half)
    ask = [(bytes([137]), counted(header, "little")), (bytes([138, 1]), scan), (bytes([138, 0]), scan)]
    robot, port = opened("s2+fluke1", *ask)
    picture = robot.picture("jpeg")
    assert picture.shape == (192, 256, 3)
    assert picture.dtype == np.uint8
    assert np.abs(picture[:, ::2].astype(int) - half).max() < 12  # JPEG
    assert (robot.picture("jpeg-fast") == picture).all()  # with the same header
    port.check_all_said()


def test_a_gray_picture_of_a_fluke_2_has_its_full_size():
    header, scan = jpeg_parts(slope(1280, 800))
    robot, port = opened("s2+fluke2", (bytes([135]), counted(header, "little")), (bytes([136, 0]), scan))
    picture = robot.picture("grayjpeg-fast")
    assert picture.shape == (800, 1280)
    assert np.abs(picture.astype(int) - slope(1280, 800)).max() < 12
    port.check_all_said()


def test_the_header_is_asked_anew_after_a_change_of_size():
    header, scan = jpeg_parts(slope(1280, 800))
    small_header, small_scan = jpeg_parts(slope(427, 266))
    robot, port = opened(
        "s2+fluke2",
        (bytes([135]), counted(header, "little")),
        (bytes([136, 1]), scan),
        (bytes([11, 71]), b""),
        (bytes([135]), counted(small_header, "little")),
        (bytes([136, 1]), small_scan),
    )
    assert robot.picture("gray").shape == (800, 1280)
    robot.set_picture_size("small")
    assert robot.picture("gray").shape == (266, 427)
    port.check_all_said()


def test_a_raw_picture_has_the_colors_of_its_bytes():
    """In each group of four: V, Y, U, Y; so neutral V and U give gray, and V alone makes it red."""
    groups = np.tile(np.array([128, 50, 128, 60], np.uint8), 256 * 192 // 4).reshape(192, 256)
    groups[:, 128:][:, ::4] = 255
    robot, port = opened("s2+fluke1", (bytes([83]), groups.tobytes()))
    picture = robot.picture("color")
    assert picture[0, :4].tolist() == [[50] * 3, [50] * 3, [60] * 3, [60] * 3]
    red, green, blue = picture[0, 130]
    assert red == 238
    assert green == 0
    assert blue == 60
    port.check_all_said()


def test_a_raw_gray_picture_uses_the_window_that_bright_does_not():
    window = slope(128, 96)
    ask = [(bytes([127, 3, 1, 0, 255, 191, 2, 2]), b""), (bytes([84, 3]), window.tobytes())]
    robot, port = opened("s1+fluke1", *ask)
    picture = robot.picture("grayraw")
    assert picture.shape == (192, 256)
    assert (picture[::2, ::2] == window).all()
    assert (picture[1::2, 1::2] == window).all()
    port.check_all_said()


@pytest.mark.parametrize(
    ("setup", "word", "width", "height"), [("s2+fluke1", 2, 256, 192), ("s2+fluke2", 3, 1280, 800)]
)
def test_runs_of_a_blob_picture_begin_with_what_is_no_blob(setup, word, width, height):
    runs = [5, 2, width // 4 - 7, 1]  # groups of four columns; the rest of the picture is none
    data = b"".join(run.to_bytes(word, "big") for run in runs)
    robot, port = opened(setup, (bytes([82]), counted(data, "big")))
    picture = robot.picture("blob")
    assert picture.shape == (height, width)
    assert picture[0].tolist() == [0] * 20 + [255] * 8 + [0] * (width - 28)
    assert picture[1, :5].tolist() == [255] * 4 + [0]
    assert picture[2:].max() == 0
    port.check_all_said()


def test_a_fluke_that_knows_no_compression_sends_raw_pictures():
    info = INFOS["s2+fluke1"].replace(b"2.9.1", b"2.7.7")
    window = slope(128, 96)
    ask = [(bytes([127, 3, 1, 0, 255, 191, 2, 2]), b""), (bytes([84, 3]), window.tobytes())]
    port = ScriptedPort([*greeting(info), *PREPARE_1, *ask])
    robot = Scribbler(port)
    assert robot.picture("gray").shape == (192, 256)
    port.check_all_said()
    with pytest.raises(
        RobotError, match=r"'get_ir_message' needs a Fluke with firmware 2\.8\.1 or newer; here is S2"
    ):
        robot.get_ir_message()


def test_bright_sums_the_three_windows():
    ask = [(bytes([88, k]), bytes([k, 1, 0])) for k in range(3)]
    robot, port = opened("s2+fluke1", *ask)
    assert robot.bright() == (256, 65536 + 256, 131072 + 256)
    port.check_all_said()


def test_a_picture_that_is_none_is_asked_again_and_then_one_clear_error():
    _, scan = jpeg_parts(slope(128, 192))
    broken = b"\xff\xd8\xff\xe0" + bytes(20)

    class Port(ScriptedPort):
        def write(self, data: bytes) -> int:
            answers = {135: counted(broken, "little"), 136: scan, 89: b"\x00\xb4"}
            if not self.script and data[0] in answers:
                self.writes.append(data)
                self.incoming += answers[data[0]]
                return len(data)
            if not self.script:
                self.script = [(data, data + bytes([1] * 2 + [0] * 9))]
            return super().write(data)

    port = Port([*greeting(INFOS["s2+fluke1"]), *PREPARE_1])
    robot = Scribbler(port)
    with pytest.raises(
        ProtocolError, match=r"picture cannot be read .*'picture' on /dev/test \(sent 5 times; motors"
    ):
        robot.picture("gray")
    assert port.writes.count(bytes([136, 1])) == 5


def test_a_damaged_header_that_asks_for_a_huge_picture_is_refused_before_it_is_made():
    header, scan = jpeg_parts(slope(128, 192))
    at = header.index(b"\xff\xc0") + 5  # of the frame: marker, length, bits; then height and width
    size = _images.Size(256, 192)
    for height, width in ((60_000, 60_000), (192, 600)):
        huge = header[:at] + height.to_bytes(2, "big") + width.to_bytes(2, "big") + header[at + 4 :]
        with pytest.raises(ProtocolError, match=r"The picture cannot be read \("):
            _images.jpeg_pixels(huge, scan, size, gray=True)
    assert _images.jpeg_pixels(header, scan, size, gray=True).shape == (192, 256)


def test_an_unknown_kind_and_a_missing_camera_are_said():
    robot = Scribbler(ScriptedPort(greeting(INFOS["s2+fluke1"])))
    with pytest.raises(ValueError, match=r"Unknown kind of picture 'jpg'. Did you mean 'jpeg'"):
        robot.picture("jpg")
    robot = Scribbler(ScriptedPort(greeting(INFOS["s2"])))
    with pytest.raises(RobotError, match="'picture' needs a Fluke"):
        robot.picture()
    robot = Scribbler(ScriptedPort(greeting(INFOS["s2+fluke1"])))
    with pytest.raises(RobotError, match="'set_picture_size' needs a Fluke 2"):
        robot.set_picture_size("small")

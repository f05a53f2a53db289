"""Every function that speaks to a robot, on each of the five set-ups, through the bytes of a real one."""

import math

import pytest

from realitygap.classroom import myro
from realitygap.classroom.myro import MyroError, _robot
from realitygap.classroom.myro._catalog import DONE
from realitygap.errors import RobotError

from .conftest import open_robot

NEED_FLUKE = [
    "getObstacle",
    "getBright",
    "getBlob",
    "getBattery",
    "takePicture",
    "autoCamera",
    "wall",
    "getIRMessage",
]
NEED_S2 = ["getPosition", "getAngle", "getEncoders", "getMotorStats", "getMicEnvelope", "getDistance", "beginPath",
           "endPath", "hereIs"]  # fmt: skip


def has_fluke(robot):
    return robot.driver.info.fluke != "none"


def is_s2(robot):
    return robot.driver.info.model == "s2"


# opening


def test_the_robot_greets_and_is_known_as_robot(setup, capsys):
    opened = open_robot(*setup)
    assert capsys.readouterr().out == "Hello, I'm Scribby!\n"
    assert robot is opened  # noqa: F821  # as in Myro, a name that every program knows
    assert opened.driver.info.model == setup[0]
    assert opened.driver.info.fluke == setup[1]


def test_opening_another_robot_lets_go_of_the_first(full):
    first = full
    second = open_robot("s1", "none")
    assert _robot.robot_or_none() is second
    assert not first._driver.link.is_open


def test_a_robot_is_an_object_too():
    with myro.Scribbler("emulator://s2?speed=off") as own:
        own.forward(1, 0.5)
        assert "s2" in repr(own)
    assert _robot.robot_or_none() is None
    made = myro.makeRobot("Scribbler", "emulator://s1?speed=off")
    assert made.driver.info.model == "s1"
    with pytest.raises(MyroError, match="makeRobot: the kind is 'Create'"):
        myro.makeRobot("Create", "com5")


def test_a_connection_is_closed_and_opened_again(robot):
    myro.closeConnection()
    with pytest.raises(RobotError):
        myro.getStall()
    myro.openConnection()
    assert myro.getStall() == 0


def test_initialize_without_an_argument_asks_for_the_port(monkeypatch):
    monkeypatch.setattr("builtins.input", lambda prompt="": '"emulator://s1?speed=off"')
    myro.init()
    assert myro.identifyRobot() == "SCRIBBLER-1"


@pytest.mark.parametrize(
    ("port", "message"),
    [
        ("/dev/no-such-port", r"no-such-port(.|\n)*initialize\(\"sim\"\) needs no robot"),
        ("emulator://s3", "s3"),
        ([], "expected text"),
        ("sim?seeed=1", r"the option is 'seeed', expected .* Did you mean 'seed'"),
        ("sim?speed=fast", r"the speed is 'fast', expected a number"),
        ("sim?arena=moon", "Unknown arena 'moon'"),
        ("sim?start=1", "the start is"),
        ("sim?start=9,9,0", "not inside the arena"),
    ],
)
def test_a_port_that_cannot_be_opened_is_said_plainly(port, message):
    with pytest.raises(MyroError, match=message):
        myro.initialize(port)
    assert _robot.robot_or_none() is None


def test_options_of_the_simulator_are_refused_for_other_ports():
    with pytest.raises(MyroError, match="only a simulated robot has that"):
        myro.initialize("emulator://s2?speed=off", seed=3)


# moving

MOVES = [
    (lambda: myro.forward(0.5), (1, 1)),
    (lambda: myro.backward(0.5), (-1, -1)),
    (lambda: myro.forward(), (2, 2)),
    (lambda: myro.turnLeft(0.5), (-1, 1)),
    (lambda: myro.turnRight(0.5), (1, -1)),
    (lambda: myro.turn("left", 0.5), (-1, 1)),
    (lambda: myro.turn("RIGHT", 0.5), (1, -1)),
    (lambda: myro.turn("straight"), (0, 0)),
    (lambda: myro.turn(0.5), (-1, 1)),
    (lambda: myro.move(0.5, 0), (1, 1)),
    (lambda: myro.move(0.5, 0.5), (0, 2)),
    (lambda: myro.motors(0.5, -0.5), (1, -1)),
    (lambda: myro.translate(0.5), (1, 1)),
    (lambda: myro.rotate(0.5), (-1, 1)),
    (lambda: (myro.translate(0.5), myro.rotate(0.5)), (0, 2)),  # they blend
    (lambda: (myro.rotate(0.5), myro.translate(0.5)), (0, 2)),
    (lambda: (myro.motors(1, 1), myro.rotate(0)), (2, 2)),
    (lambda: myro.forward(7), (2, 2)),  # limited
    (lambda: (myro.forward(1), myro.stop()), (0, 0)),
    (lambda: (myro.forward(1), myro.requestStop()), (0, 0)),
]


@pytest.mark.parametrize("move", range(len(MOVES)))
def test_each_way_of_moving_turns_the_wheels_as_myro_says(robot, witness, move):
    """Wheels as the driver sees them: ahead is ahead, whichever end it is."""
    act, (left, right) = MOVES[move]
    sent = []
    motors = robot._driver.motors
    robot._driver.motors = lambda *wheels: (sent.append(wheels), motors(*wheels))
    act()
    assert sent[-1] == (left / 2, right / 2) or (left, right) == (0, 0)
    myro.wait(0.5)
    speeds = witness().motors()
    for speed, expected in zip(speeds, (left, right), strict=True):
        assert (speed > 0.05) == (expected > 0)
        assert (speed < -0.05) == (expected < 0)


@pytest.mark.parametrize("name", ["forward", "backward", "turnLeft", "turnRight"])
def test_a_move_with_seconds_blocks_and_ends(robot, witness, name):
    before = robot.clock.now()
    getattr(myro, name)(1, 2)
    assert robot.clock.now() - before == pytest.approx(2, abs=0.1)
    assert witness().motors() == (0, 0)


def test_a_move_without_seconds_goes_on(robot, witness):
    before = robot.clock.now()
    myro.forward(1)
    assert robot.clock.now() - before < 0.1
    start = witness().pose()
    myro.wait(1)
    assert math.dist(start[:2], witness().pose()[:2]) > 0.1


def test_left_is_left(robot, witness):
    before = witness().pose().heading
    myro.turnLeft(0.5, 0.5)
    assert 0.2 < (witness().pose().heading - before) % (2 * math.pi) < math.pi


def test_forward_is_the_end_that_is_ahead(robot, witness):
    start = witness().pose()
    myro.forward(1, 1)
    end = witness().pose()
    ahead = (end.x - start.x) * math.cos(start.heading) + (end.y - start.y) * math.sin(start.heading)
    assert ahead > 0.1


def test_an_interrupted_move_stops_the_robot(full, witness, monkeypatch):
    monkeypatch.setattr(full.clock, "sleep", lambda seconds: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        myro.forward(1, 5)
    assert full._driver.last_sensors is not None
    assert witness().motors() == (0, 0)


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: myro.forward("fast"), "forward: the speed is 'fast', expected a number"),
        (lambda: myro.forward(1, -1), "forward: the seconds is -1"),
        (lambda: myro.turn("up"), "turn: the direction is 'up'"),
        (lambda: myro.motors(1, None), "motors: right is None"),
        (lambda: myro.move(float("nan"), 0), "move: translate is nan"),
    ],
)
def test_wrong_moves_are_refused_and_the_robot_is_not_told(full, witness, act, message):
    with pytest.raises(MyroError, match=message):
        act()
    assert witness().motors() == (0, 0)


# senses


def test_senses_of_the_robot_have_myros_shapes(robot):
    light, ir, line = myro.getLight(), myro.getIR(), myro.getLine()
    assert [len(light), len(ir), len(line)] == [3, 2, 2]
    assert all(isinstance(value, list) for value in (light, ir, line))
    assert all(0 <= value <= 65535 for value in light)
    assert ir == [1, 1]
    assert line == [0, 0]
    assert myro.getStall() == 0
    for where in ("left", "center", "middle", "right", 0, 1, 2):
        assert isinstance(myro.getLight(where), int)
    assert len(myro.getLight("left", "right")) == 2
    assert myro.getIR("left") == myro.getIR(1) == 1
    assert myro.getLine("right") == 0


def test_get_all_returns_all_senses_of_the_robot(robot):
    readings = myro.getAll()
    own = {"light", "ir", "line", "stall"}
    assert set(readings) == (own | {"obstacle", "bright", "blob", "battery"} if has_fluke(robot) else own)
    assert set(robot.getLastSensors()) == own


def test_senses_are_printed(robot, capsys):
    capsys.readouterr()
    myro.senses()
    out = capsys.readouterr().out
    assert "light: " in out
    assert ("battery: " in out) == has_fluke(robot)


def test_senses_by_name_are_those_of_the_functions(robot):
    assert myro.get("stall") == 0
    assert myro.get("IR") == [1, 1]
    assert myro.get("line", "left") == 0
    assert len(myro.get("light")) == 3
    assert set(myro.get()) == set(myro.getAll())
    assert myro.get("name") == "Scribby"
    assert myro.get("volume") == 1
    assert myro.get("startsong") == "tada"
    assert myro.get("config")["light"] == 3
    assert ("obstacle" in myro.get("config")) == has_fluke(robot)
    assert myro.get("info") == myro.getInfo()
    with pytest.raises(MyroError, match=r"get: the sensor is 'lihgt'.*Did you mean 'light'"):
        myro.get("lihgt")


def test_senses_of_the_fluke_need_a_fluke(robot):
    if not has_fluke(robot):
        for name in NEED_FLUKE:
            with pytest.raises(RobotError, match="needs a Fluke"):
                getattr(myro, name)()
        return
    assert len(myro.getObstacle()) == len(myro.getBright()) == len(myro.getBright("all")) == 3
    assert isinstance(myro.getObstacle("center"), int)
    assert isinstance(myro.getBright(2), int)
    assert len(myro.getBlob()) == 3
    assert 7 < myro.getBattery() < 10
    assert myro.wall() in (True, False)


@pytest.mark.parametrize("fluke", ["1", "2"])
def test_a_wall_ahead_is_seen(fluke):
    robot = open_robot("s2", fluke)
    far = myro.getObstacle("center")
    while not myro.wall():
        myro.forward(0.5, 0.2)
        assert robot.clock.now() < 60
    assert far < 1000
    assert not myro.wall(6400)


def test_a_wall_ahead_of_the_scribblers_own_sensors_is_seen(robot):
    if has_fluke(robot):
        myro.setForwardness("scribbler-forward")
    while myro.getIR() == [1, 1]:
        myro.forward(0.5, 0.2)
        assert robot.clock.now() < 60


def test_a_blocked_robot_stalls(robot):
    myro.forward(1)
    while not myro.getStall():
        myro.wait(0.5)
        assert robot.clock.now() < 90
    assert myro.getStall() == 1


def test_senses_of_a_scribbler_2_need_one(robot):
    if not is_s2(robot):
        for name in NEED_S2:
            with pytest.raises(RobotError, match="needs an S2"):
                getattr(myro, name)()
        return
    assert myro.getDistance() == [99, 99]
    assert myro.getDistance("left") == 99
    assert isinstance(myro.getMicEnvelope(), int)
    assert myro.getEncoders() == [0, 0]
    stats = myro.getMotorStats()
    assert set(stats) == {"wheel", "IdlerTimer", "IdlerSpeed", "Mov", "Ready"}
    assert stats["Mov"] == [False]


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: myro.getLight("lft"), r"getLight: the position is 'lft', expected .* Did you mean 'left'\?"),
        (lambda: myro.getIR("center"), "getIR: the position is 'center'"),
        (lambda: myro.getObstacle(3), "getObstacle: the position is 3"),
        (lambda: myro.getBright("top"), "getBright: the position is 'top'"),
        (lambda: myro.getInfo("color"), "says nothing of 'color'"),
    ],
)
def test_wrong_positions_are_refused_with_the_right_ones(full, act, message):
    with pytest.raises(MyroError, match=message):
        act()


# sound and lights


def test_a_tone_lasts_as_long_as_it_should(robot):
    for duration in (0.3, 9.0):  # the second in pieces: a Scribbler 2 plays up to 8.2 s
        before = robot.clock.now()
        myro.beep(duration, 440)
        assert robot.clock.now() - before == pytest.approx(duration, abs=0.2)
    before = robot.clock.now()
    myro.beep(0.2, 440, 660)
    myro.beep(0.2)
    myro.beep([300, 400])
    myro.beep(0.1, [300, 400], [500, 600])
    myro.beep(0.1, 0)
    assert robot.clock.now() - before == pytest.approx(1.7, abs=0.4)


def test_a_song_keeps_its_tempo(robot):
    song = myro.makeSong("C 1/4; E G 1/4; pause 1/4; C6 1/4")
    before = robot.clock.now()
    myro.playSong(song, 2)
    assert robot.clock.now() - before == pytest.approx(2, abs=0.2)
    myro.playNote((440, 1))
    assert robot.clock.now() - before == pytest.approx(2.545, abs=0.3)
    myro.scaleUp(1)
    myro.scaleDown(2)
    with pytest.raises(MyroError, match="the song is text"):
        myro.playSong("C 1/4")
    with pytest.raises(MyroError, match="playNote: the note is 440"):
        myro.playNote(440)


def test_volume_and_start_song_are_set(robot):
    myro.setVolume("off")
    assert myro.getVolume() == 0
    myro.setVolume(1)
    assert myro.getVolume() == 1
    myro.setStartSong("hymn")
    assert myro.getStartSong() == "hymn"
    if is_s2(robot):
        myro.setS2Volume(50)
    else:
        with pytest.raises(RobotError, match="needs an S2"):
            myro.setS2Volume(50)
    with pytest.raises(MyroError, match="from 0 to 100"):
        myro.setS2Volume(101)


def test_lights_of_the_robot_and_of_its_fluke_are_set(robot):
    for where in ("left", "center", "middle", "right", "all", 0, 1, 2):
        for value in ("on", "off", 1, 0):
            myro.setLED(where, value)
    myro.set("led", "left", "on")
    fluke_lights = (
        lambda: myro.setLED("front", 1), lambda: myro.setLED("back", 0.5), lambda: myro.setLED("back", "on"),
        lambda: myro.setLEDFront(0), lambda: myro.setLEDBack(7), lambda: myro.setLEDBack("off"),
    )  # fmt: skip
    for act in fluke_lights:
        if has_fluke(robot):
            act()
        else:
            with pytest.raises(RobotError, match="needs a Fluke"):
                act()
    with pytest.raises(MyroError, match="setLED: the position is 'top'"):
        myro.setLED("top", 1)


# camera


@pytest.mark.parametrize("mode", [None, "jpeg", "jpeg-fast", "color", "gray", "grey", "grayjpeg", "grayjpeg-fast",
                                  "grayraw", "blob"])  # fmt: skip
@pytest.mark.parametrize("fluke", ["1", "2"])
def test_pictures_of_every_kind_have_the_cameras_size(fluke, mode):
    open_robot("s2", fluke)
    if fluke == "2":
        myro.setPicSize("small")
    picture = myro.takePicture(mode)
    assert (picture.width, picture.height) == ((256, 192) if fluke == "1" else (427, 266))
    if mode in ("gray", "grayraw", "blob"):
        red, green, blue = myro.getRGB(myro.getPixel(picture, 100, 100))
        assert red == green == blue


def test_a_fluke_2_takes_large_pictures(full):
    assert myro.takePicture().width == 1280
    assert full.get("picture", "gray").width == 1280
    with pytest.raises(MyroError, match=r"takePicture: the mode is 'colour'.*Did you mean 'color'"):
        myro.takePicture("colour")


def test_the_camera_is_set(robot):
    settings = (
        lambda: myro.configureBlob(0, 255, 100, 150, 60, 120, 4), lambda: myro.darkenCamera(),
        lambda: myro.darkenCamera(40), lambda: myro.manualCamera(10, 100, 60), lambda: myro.autoCamera(),
        lambda: myro.setWhiteBalance("off"), lambda: myro.set("whitebalance", 1), lambda: myro.setIRPower(140),
        lambda: myro.set("irpower", 135),
    )  # fmt: skip
    for act in settings:
        if has_fluke(robot):
            act()
        else:
            with pytest.raises(RobotError, match="needs a Fluke"):
                act()
    if robot.driver.info.fluke == "2":
        myro.setPicSize("large")
    else:
        with pytest.raises(RobotError, match="Fluke 2"):
            myro.setPicSize("large")


def test_the_color_of_a_rectangle_becomes_the_color_to_look_for(full):
    myro.setPicSize("small")
    picture = myro.takePicture()
    limits = full.set_blob_yuv(picture, 100, 200, 120, 220)
    assert limits[:2] == (0, 254)
    assert limits[2] <= limits[3]
    assert myro.getBlob()[0] > 0


# identity


def test_names_passwords_and_data_are_kept(robot):
    myro.setName("Rosa")
    myro.setPassword("secret")
    assert (myro.getName(), myro.getPassword()) == ("Rosa", "secret")
    myro.set("name", "Karl")
    myro.set("password", "x1")
    assert (myro.get("name"), myro.get("password")) == ("Karl", "x1")
    robot.setData(7, 42)
    myro.set("data", 6, 41)
    assert robot.getData(7) == 42
    assert robot.getData(6, 7) == [41, 42]
    assert len(robot.getData()) == 8
    robot.setFudge(1.1, 1.0, 0.9, 1.0)
    assert robot.getFudge() == pytest.approx((1.1, 1.0, 0.9, 1.0), abs=0.01)
    with pytest.raises(MyroError, match="up to 16 letters"):
        myro.setName("a name that is much too long")


def test_the_end_that_is_ahead_is_set_with_a_fluke_only(robot):
    if not has_fluke(robot):
        assert myro.getForwardness() == "scribbler-forward"
        with pytest.raises(RobotError, match="needs a Fluke"):
            myro.setForwardness(1)
        return
    for value, name in (
        ("scribbler-forward", "scribbler"),
        (1, "fluke"),
        (0, "scribbler"),
        ("fluke-forward", "fluke"),
    ):
        myro.setForwardness(value)
        assert myro.getForwardness() == f"{name}-forward"
    myro.set("forwardness", 0)
    assert myro.get("forwardness") == "scribbler-forward"
    with pytest.raises(MyroError, match="setForwardness: the value is 'left'"):
        myro.setForwardness("left")


def test_the_robot_reports_its_kind_and_its_versions(robot):
    info = myro.getInfo()
    assert info["robot"] == ("Scribbler2" if is_s2(robot) else "Scribbler")
    assert ("fluke" in info) == has_fluke(robot)
    assert myro.getInfo("robot") == info["robot"]
    assert myro.getInfo("robot", "mode") == [info["robot"], "Serial"]
    assert myro.getVersion() == info["robot-version"]
    assert myro.identifyRobot() == ("SCRIBBLER-2" if is_s2(robot) else "SCRIBBLER-1")


def test_version_is_the_only_answer_without_a_robot():
    assert set(myro.getInfo()) == {"myro"}


def test_restart_greets_and_update_does_nothing(robot, capsys):
    myro.restart()
    assert "Hello, I'm Scribby!" in capsys.readouterr().out
    assert myro.update() is None


def test_a_robot_that_is_reset_answers_again(robot):
    robot.reboot()
    assert myro.getName() == "Scribby"


def test_wrong_items_to_set_are_refused(full):
    with pytest.raises(MyroError, match=r"set: the item is 'led2'"):
        myro.set("led2", 0, 1)
    with pytest.raises(MyroError, match=r"set\(\) was given 4 values"):
        myro.set(1, 2, 3, 4)


# a Scribbler 2's places, a Fluke's extras


@pytest.fixture(params=["none", "2"])
def s2(request):
    """A Scribbler 2 in the middle of the arena, the end with the light sensors ahead."""
    opened = open_robot("s2", request.param)
    if request.param != "none":
        myro.setForwardness("scribbler-forward")
    opened.driver.port.witness.place((0.5, 0.3, 0.0), 1)
    return opened


def test_places_and_angles_are_reckoned(s2):
    myro.hereIs(100, 50)
    myro.setAngle(90)
    assert (myro.getPosition(), myro.getAngle()) == ([100, 50], 90)
    s2.setHereIs(0, 0)
    assert myro.getPosition() == [0, 0]


def test_driving_to_a_place_goes_on_when_arrived(s2, witness):
    myro.moveTo(400, 0)  # half millimeters
    assert witness().pose().x == pytest.approx(0.7, abs=0.01)
    assert myro.getPosition() == [200, 0]
    myro.turnBy(90)
    myro.moveBy(0, 200)
    assert witness().pose().y == pytest.approx(0.4, abs=0.015)
    assert min(myro.getEncoders()) > 0
    assert myro.getEncoders(True) != [0, 0]
    assert myro.getEncoders() == [0, 0]


def test_turns_go_to_and_by_degrees_and_radians(s2, witness):
    myro.turnTo(90, "deg")
    assert math.degrees(witness().pose().heading) == pytest.approx(90, abs=3)
    myro.turnBy(math.pi / 2, "rad")
    assert math.degrees(witness().pose().heading) % 360 == pytest.approx(180, abs=3)
    s2.setTurn(0, "to", "deg")
    assert math.cos(witness().pose().heading) == pytest.approx(1, abs=0.01)
    with pytest.raises(MyroError, match="turnBy: the unit is 'turns'"):
        myro.turnBy(1, "turns")


def test_arcs_and_paths_work_under_both_names(s2, witness):
    myro.arcBy(200, 200, 200)
    start = witness().pose()
    myro.arcTo(0, 0, 300)
    s2.setArc(50, 50, 100, "by")
    s2.setMove(50, 0, "by")
    assert witness().pose() != start
    myro.beginPath()
    s2.setEndPath()
    s2.setBeginPath(5)
    myro.endPath()
    with pytest.raises(MyroError, match="beginPath: the speed is 16"):
        myro.beginPath(16)
    with pytest.raises(MyroError, match="moveTo: x"):
        myro.moveTo(1e6, 0)


def test_infrared_messages_need_a_fluke_and_plain_letters(robot):
    acts = (
        lambda: myro.setCommunicateLeft(), lambda: myro.setCommunicateCenter(False),
        lambda: myro.setCommunicateRight(True), lambda: myro.setCommunicateAll("off"), lambda: myro.sendIRMessage("hi"),
        lambda: myro.getIRMessage(),
    )  # fmt: skip
    for act in acts:
        if has_fluke(robot):
            assert act() in (None, "")
        else:
            with pytest.raises(RobotError, match="needs a Fluke"):
                act()
    with pytest.raises(MyroError, match="no accents"):
        myro.sendIRMessage("né")


def test_messages_go_to_the_sides_that_were_chosen(full, monkeypatch):
    chosen = {}
    monkeypatch.setattr(full._driver, "set_ir_emitters", lambda **sides: chosen.update(sides))
    myro.setCommunicateAll(False)
    assert chosen == {"left": False, "center": False, "right": False}
    for side in ("left", "center", "right"):
        getattr(myro, f"setCommunicate{side.title()}")()
        assert chosen[side]
        assert sum(chosen.values()) == 1
        getattr(myro, f"setCommunicate{side.title()}")(False)
        assert not any(chosen.values())
    myro.setCommunicateAll()
    assert all(chosen.values())


def test_servos_log_and_network_need_a_fluke_2(robot, capsys):
    acts = (lambda: myro.servo(0, 100), lambda: myro.getFlukeLog(), lambda: myro.enablePanNetworking())
    for act in acts:
        if robot.driver.info.fluke == "2":
            act()
        else:
            with pytest.raises(RobotError, match="a Fluke"):
                act()
    with pytest.raises(MyroError, match="servo: the number is 4"):
        myro.servo(4, 0)


# all of them

ARGUMENTS = {
    "forward": (0, 0.1), "backward": (0, 0.1), "turnLeft": (0, 0.1), "turnRight": (0, 0.1), "turn": ("left", 0.1, 0.1),
    "move": (0.1, 0), "translate": (0.1,), "rotate": (0.1,), "motors": (0.1, 0.1), "playNote": ((440, 0.1),),
    "playSong": ([(440, 0.1)],), "setVolume": (1,), "setS2Volume": (50,), "setStartSong": ("a",), "setLED": (0, 1),
    "setLEDFront": (1,), "setLEDBack": (1,), "set": ("led", 0, 1), "setPicSize": ("small",), "setWhiteBalance": (1,),
    "setName": ("a",), "setPassword": ("a",), "setForwardness": (1,), "setAngle": (0,), "moveTo": (20, 0),
    "moveBy": (20, 0), "turnTo": (10,), "turnBy": (10,), "arcTo": (20, 20, 20), "arcBy": (20, 20, 20),
    "setIRPower": (135,), "sendIRMessage": ("a",), "servo": (0, 0), "beepScale": (0.1, 100, 200),
    "beep": (0.1, 440), "scaleUp": (1,), "scaleDown": (1,),
}  # fmt: skip
WITH_ROBOT = [
    name
    for group in ("Moving", "Senses", "Sound", "Lights", "Camera", "Who the robot is",
                  "Places and paths (Scribbler 2)", "Fluke")
    for name in DONE[group] if name not in ("computer", "Computer")
] + ["restart", "requestStop", "update", "openConnection", "closeConnection"]  # fmt: skip


def test_no_function_ends_in_anything_but_a_result_or_one_message(robot):
    """Each function on each set-up: it does its work, or says which set-up has what it needs."""
    refused = []
    for name in WITH_ROBOT:
        try:
            getattr(myro, name)(*ARGUMENTS.get(name, ()))
        except RobotError as error:
            refused.append(str(error))
    assert all("needs" in message for message in refused)
    assert (refused == []) == (robot.driver.info.fluke == "2")

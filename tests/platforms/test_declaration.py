"""Networks see and answer what they declare, on every platform that has it; others refuse in one message."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realitygap.errors import ControllerError, StudyError
from realitygap.evolution import ControllerInterface, Genome, inputs_of_robot
from realitygap.families.scribbler import Scribbler, ScribblerPlatform
from realitygap.platforms import (
    JyroPlatform,
    SimEnsemble,
    SimPlatform,
    TwinPlatform,
    open_target,
    platform_of,
    trace_genome,
)
from realitygap.platforms._stepwise import trial_of
from realitygap.platforms.sim._robot import SimRobot
from realitygap.playback import WatchedRobot
from realitygap.robots import Command, RecordedRobot, channels_of, read_recording
from realitygap.robots.twin import load_twin, sample_twin
from realitygap.study import drive_study, gap_between, load_study, parse_study, run_study, transfer
from realitygap.trials import NoiseKey, TrialPlan, drive_trial
from realitygap.world import Floor, Light, Pose, load_arena, paper_arena

PAPER = ("obstacle", "stall", "time")
WHEELS = np.array([[-0.75, 0.5, 0.25], [0.5, -0.25, 0.5]])
"""Weights of left and right; sums never leave -1..1 for inputs within 0..1."""
COMMANDS = np.array([(WHEELS[0] + WHEELS[1]) / 2, (WHEELS[1] - WHEELS[0]) / 2])
STEPS = 12


def controller(weights: np.ndarray, interface: ControllerInterface, *, recurrent: bool = False) -> Genome:
    """Return a genome whose outputs are these weights times its inputs, (2, i)."""
    n = weights.shape[1]
    nodes = [{"id": k, "kind": "input", "bias": 0.0} for k in range(n)]
    nodes += [{"id": n + k, "kind": "output", "bias": 0.0} for k in range(2)]
    connections = [
        {
            "innovation": 1 + 2 * k + m,
            "source": k,
            "target": n + m,
            "weight": float(weights[m, k]),
            "enabled": True,
        }
        for k in range(n)
        for m in range(2)
    ]
    values = {"format": "realitygap genome", "version": 1, "activation": "identity", "activation_slope": 1.0}
    values |= {"recurrent": recurrent, "bias_value": 1.0, "node_bias": False}
    return Genome.from_dict({**values, "nodes": nodes, "connections": connections}).with_interface(interface)


def of_input(name: str) -> Genome:
    """Return a controller that sees one input."""
    return controller(np.array([[0.5], [0.25]]), ControllerInterface((name,)))


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("twins")
    (folder / "close.toml").write_text(sample_twin("close", 1).to_toml())
    (folder / "same.toml").write_text(sample_twin("same", 1).to_toml())
    (folder / "seeing.toml").write_text(sample_twin("close", 1).to_toml() + "\n[light]\n[line]\n")
    return folder


def spec_of(platform: str, files: Path) -> str:
    return f"twin:{files / platform}" if platform.endswith(".toml") else platform


# outputs


@pytest.mark.parametrize("recurrent", [False, True])
@pytest.mark.parametrize(
    "platform", [SimPlatform(precision="double", steps=40), JyroPlatform(precision="double", steps=40)]
)
def test_wheel_network_drives_as_the_network_of_the_same_commands(platform, recurrent):
    wheels, commands = (
        trace_genome(
            platform,
            paper_arena(),
            controller(weights, ControllerInterface(PAPER, outputs), recurrent=recurrent),
            noise=0.1 * (platform.name == "jyro"),
            noise_key=NoiseKey(7),
        )
        for weights, outputs in ((WHEELS, ("left", "right")), (COMMANDS, ("move", "turn")))
    )
    assert np.ptp(wheels.commands, axis=0).min() > 0
    np.testing.assert_allclose(wheels.commands, commands.commands, atol=1e-9)
    np.testing.assert_allclose(wheels.poses, commands.poses, atol=1e-9)
    assert wheels.cells == commands.cells


@pytest.mark.slow
@pytest.mark.parametrize(
    "platform", ["sim", "jyro", "close.toml", "same.toml", "scribbler:emulator://s2?fluke=2&speed=off"]
)
def test_wheel_controller_drives_targets_as_the_controller_of_the_same_commands(platform, files):
    genomes = [
        controller(weights, ControllerInterface(PAPER, outputs))
        for weights, outputs in ((WHEELS, ("left", "right")), (COMMANDS, ("move", "turn")))
    ]
    plans = [TrialPlan(genome=genome, steps=STEPS, number=3) for genome in genomes]
    with open_target(spec_of(platform, files), paper_arena()) as target:
        wheels, commands = target.carry_out(plans, "track")
    np.testing.assert_allclose(wheels.commands, commands.commands, atol=1e-6)
    np.testing.assert_allclose(wheels.poses, commands.poses, atol=1e-5)
    assert Genome.from_json(wheels.genome).interface.outputs == ("left", "right")


@given(st.tuples(*[st.floats(allow_nan=True, allow_infinity=True)] * 2))
def test_commands_of_wheels_are_within_their_limits_and_turn_back_into_them(outputs):
    move, turn = ControllerInterface(PAPER, ("left", "right")).commands(outputs)
    left, right = (0.0 if value != value else min(max(value, -1.0), 1.0) for value in outputs)
    assert max(abs(move), abs(turn)) <= 1
    np.testing.assert_allclose([move - turn, move + turn], [left, right], atol=1e-15)


@pytest.mark.slow
def test_environment_of_wheels_takes_wheel_speeds():
    wheels = gymnasium.make(
        "realitygap.gym:realitygap/Avoid-v0", controller={"outputs": ["left", "right"]}, dtype="float64"
    )
    commands = gymnasium.make("realitygap.gym:realitygap/Avoid-v0", dtype="float64")
    for environment in (wheels, commands):
        environment.reset(seed=4)
    for left, right in ([1.0, 0.5], [-0.25, 1.0], [0.5, 0.5]):
        by_wheels = wheels.step(np.array([left, right]))
        by_commands = commands.step(np.array([(left + right) / 2, (right - left) / 2]))
        np.testing.assert_array_equal(by_wheels[0], by_commands[0])
        assert by_wheels[1] == by_commands[1]


# inputs

ROOM = replace(load_arena("goal"), lights=(Light(0.3, 0.3, 1.0),), floor=Floor(tape=((0.0, 0.0, 1.0, 0.6),)))
NAMES = (
    *("obstacle", "stall", "time", "last_move", "last_turn", "goal_distance"),
    *(
        f"{kind}.{k}"
        for kind in ("range", "light", "line", "bump", "encoder", "goal_sector")
        for k in range(4)
    ),
)
PLATFORMS = (
    *("jyro", "sim", "close.toml", "seeing.toml", "same.toml"),
    *("scribbler:emulator://s1?fluke=none&speed=off", "scribbler:emulator://s2?fluke=2&speed=off"),
)


@pytest.mark.slow
@pytest.mark.parametrize("platform", PLATFORMS)
def test_every_input_drives_where_it_is_and_is_refused_in_one_message_elsewhere(platform, files):
    spec, driven, messages = spec_of(platform, files), [], {}
    with open_target(spec, paper_arena()) as target:
        for name in NAMES:
            plan = TrialPlan(genome=of_input(name), steps=2)
            try:
                (trial,) = target.carry_out([plan], "cells")
            except ControllerError as refused:
                messages[name] = str(refused)
            else:
                assert len(trial.commands) == 2
                driven.append(name)
    for name, message in messages.items():
        assert message.startswith(f"The controller sees {name}, and {spec} has ")
        assert f"{name} is missing." in message
    lacks = {"last_move", "last_turn"} if platform == "jyro" else set()
    assert {*PAPER, "last_move", "last_turn", "range.0", "range.1"} - set(driven) == lacks
    ours = platform_of(spec)
    if not ours.is_physical:
        known = set(ours.inputs(paper_arena())) - {"bias"}
        more = {name for name in driven if name.startswith("bump.")} if platform == "same.toml" else set()
        lacks = (
            {name for name in known if name.startswith(("light.", "line."))}
            if platform == "close.toml"
            else set()
        )
        assert set(driven) - more == known - lacks
    else:
        missing = {"encoder.0", "encoder.1", "range.2"} if "s1" in spec else set()
        assert set(driven) == set(ours.inputs(paper_arena())) - missing


@pytest.mark.parametrize("robot", ["scribbler-s2-fluke2", "khepera"])
@pytest.mark.parametrize("noise", [True, False])
def test_stepped_robot_of_sim_sees_every_input_of_the_batch(robot, noise):
    platform = SimPlatform(robot=robot, precision="double", steps=STEPS, noise=noise)
    names = tuple(name for name in platform.inputs(ROOM) if name != "bias")
    weights = np.random.default_rng(3).uniform(-0.3, 0.3, (2, len(names)))
    genome, key = controller(weights, ControllerInterface(names)), NoiseKey(5)
    batch = trace_genome(platform, ROOM, genome, noise=0.0, noise_key=key, inputs=names)
    stepped = SimRobot(platform, ROOM, noise_key=key)
    trial = trial_of(stepped, ROOM, genome.network(), genome.interface, STEPS, trace=True)
    assert {"light.0", "goal_distance", "last_turn"} <= set(names)
    np.testing.assert_array_equal(np.array(trial["inputs"]), batch.inputs)
    np.testing.assert_array_equal(np.array(trial["commands"]), batch.commands)


def test_a_later_controller_of_other_inputs_drives_the_same_robot():
    robot = SimRobot(SimPlatform(steps=3), ROOM)
    for name in ("light.0", "time", "encoder.1"):
        driven = drive_trial(robot, of_input(name).network(), 3, interface=ControllerInterface((name,)))
        assert driven.commands[0, 0] == pytest.approx(0.5 * robot_input(name, robot), abs=1e-6)


def robot_input(name: str, robot: SimRobot) -> float:
    """Return the first value of an input in a trial of its own."""
    robot.select([name] if "." in name else [])
    robot.reset()
    seen = robot.observe()
    return seen.channels.get(name, 0.0)


# the Scribbler


def emulated(options: str, pose: Pose, record: Path | None = None) -> Scribbler:
    """Return an emulated Scribbler at a pose in the arena with a light and with tape on its floor."""
    robot = Scribbler(f"emulator://{options}&speed=off", record=record)
    robot.port.witness.place(pose, 1)
    return robot


def asked(record: Path) -> list[str]:
    """Return the names of the commands on the wire, from the first observation on."""
    lines = [(line["kind"], line["name"]) for line in read_recording(record).lines]
    return [name for kind, name in lines[lines.index(("call", "reset")) :] if kind == "wire"]


@pytest.mark.parametrize(
    ("names", "more"),
    [
        ((), set()),
        (("light.1", "light.0"), {"light"}),
        (("line.0",), {"line"}),
        (("encoder.0", "encoder.1"), {"encoders"}),
    ],
)
def test_sensors_that_no_controller_sees_are_not_read(tmp_path, names, more):
    with emulated("s2?fluke=2", Pose(0.3, 0.3, 0.0), tmp_path / "robot.jsonl") as robot:
        robot.select(names)
        robot.reset()
        seen = robot.observe()
    assert set(seen.channels) == set(names)
    assert {"light", "line", "encoders"} & set(asked(tmp_path / "robot.jsonl")) == more


def test_recorded_channels_are_seen_again(tmp_path):
    interface = ControllerInterface(("light.0", "time"))
    network = controller(np.array([[0.5, 0.1], [0.2, 0.1]]), interface).network()
    with emulated("s2?fluke=2", Pose(0.3, 0.3, 0.0), tmp_path / "robot.jsonl") as robot:
        driven = drive_trial(robot, network, 3, interface=interface)
    with RecordedRobot(tmp_path / "robot.jsonl") as recorded:
        assert recorded.channels == ("light.0",)
        again = drive_trial(recorded, network, 3, interface=interface)
    np.testing.assert_array_equal(again.commands, driven.commands)


@pytest.mark.parametrize("options", ["s1?fluke=none&arena=light", "s2?fluke=none&arena=light"])
def test_light_of_the_emulated_robot_is_brightest_where_it_faces_the_lamp(options):
    (lamp,) = load_arena("light").lights
    names = ("light.0", "light.1", "light.2")
    seen = {}
    for side, heading in (("ahead", 0.0), ("left", -0.6), ("right", 0.6), ("away", np.pi)):
        with emulated(options, Pose(lamp.x - 0.3, lamp.y, heading)) as robot:
            robot.select(names)
            robot.reset()
            seen[side] = [robot.observe().channels[name] for name in names]
    assert all(0 <= value <= 1 for values in seen.values() for value in values)
    assert seen["ahead"][1] > seen["away"][1] + 0.15
    assert seen["left"][0] > seen["left"][2]
    assert seen["right"][2] > seen["right"][0]


@pytest.mark.parametrize("fluke", [True, False])
def test_encoders_tell_speeds_as_parts_of_full_speed_by_the_end_ahead(fluke):
    with emulated("s2?fluke=2" if fluke else "s2?fluke=none", Pose(0.25, 0.3, 0.0)) as robot:
        if fluke:
            robot.set_forwardness("fluke")
        names = ("encoder.0", "encoder.1")
        robot.select(names)
        robot.reset()
        assert [robot.observe().channels[name] for name in names] == [0.0, 0.0]
        for move, turn in ((0.5, 0.25), (0.0, -0.5)):
            for _ in range(2):  # the second one at the speeds of the first
                robot.drive(Command(move, turn))
                channels = robot.observe().channels
            assert [channels[name] for name in names] == pytest.approx([move - turn, move + turn], abs=0.1)


def test_encoders_of_a_twin_tell_speeds_as_parts_of_full_speed(files):
    robot = platform_of(f"twin:{files / 'same.toml'}").open_robot(paper_arena())
    twin = platform_of(f"twin:{files / 'close.toml'}").open_robot(paper_arena())
    for each in (robot, twin):
        each.select(("encoder.1", "encoder.0"))
        each.reset()
        for _ in range(2):
            each.drive(Command(0.5, 0.25))
        channels = each.observe().channels
        assert list(channels) == ["encoder.1", "encoder.0"]
        assert [channels["encoder.0"], channels["encoder.1"]] == pytest.approx([0.25, 0.75], abs=0.15)


def test_light_of_a_twin_is_brightest_where_it_faces_the_lamp(files):
    (lamp,) = load_arena("light").lights
    names = ("light.0", "light.1", "light.2")
    twin = platform_of(f"twin:{files / 'seeing.toml'}").open_robot(load_arena("light"))
    seen = {}
    for side, heading in (("behind", np.pi), ("left", np.pi - 0.6), ("right", np.pi + 0.6), ("away", 0.0)):
        twin.select(names)
        twin.reset(Pose(lamp.x - 0.3, lamp.y, heading))
        seen[side] = [twin.observe().channels[name] for name in names]
    assert all(0 <= value <= 1 for values in seen.values() for value in values)
    assert seen["behind"][1] > seen["away"][1] + 0.15  # the sensors are at the end that is behind
    assert seen["left"][0] > seen["left"][2]
    assert seen["right"][2] > seen["right"][0]


@pytest.mark.parametrize("dark", [True, False])
def test_line_of_a_twin_and_of_the_robot_is_1_above_tape(files, dark):
    y = 0.3 if dark else 0.5
    arena = replace(paper_arena(), floor=Floor(tape=((0.1, 0.3, 0.9, 0.3),), tape_width=0.05))
    twin = platform_of(f"twin:{files / 'seeing.toml'}").open_robot(arena)
    sim = SimRobot(SimPlatform(), arena)
    for robot in (twin, sim):
        robot.select(("line.0", "line.1"))
        robot.reset(Pose(0.5, y, 0.0))
        assert dict(robot.observe().channels) == {"line.0": float(dark), "line.1": float(dark)}


def test_twins_without_light_are_written_as_before(files):
    assert "[light]" not in sample_twin("close", 1).to_toml()
    seeing = load_twin(files / "seeing.toml")
    assert (len(seeing.light.mount), len(seeing.line.mount)) == (3, 2)


def test_one_message_names_the_inputs_that_a_robot_lacks_before_it_moves():
    with emulated("s1?fluke=none", Pose(0.3, 0.3, 0.0)) as robot:
        assert channels_of(robot) == ("light.0", "light.1", "light.2", "line.0", "line.1")
        assert "encoder.0" not in inputs_of_robot(robot.n_sensors, channels_of(robot))
        interface = ControllerInterface(("encoder.0",))
        with pytest.raises(ControllerError, match=r"encoder\.0 is missing"):
            drive_trial(robot, of_input("encoder.0").network(), 3, interface=interface)


# commands that follow the declaration

SEES = ControllerInterface(("range.0", "range.2", "encoder.0", "time"), ("left", "right"))
SEES_WEIGHTS = np.array([[-0.5, 0.25, 0.125, 0.25], [0.25, -0.5, 0.25, 0.25]])


@pytest.mark.parametrize(
    "platform",
    ["jyro", "sim", *(pytest.param(twin, marks=pytest.mark.slow) for twin in ("close.toml", "seeing.toml"))],
)
def test_networks_driven_through_the_environment_are_their_trials(platform, files):
    names = [name for name in SEES.inputs if platform != "jyro" or name != "encoder.0"]
    if platform == "seeing.toml":
        names += ["light.1", "last_turn"]
    interface = ControllerInterface(tuple(names), ("left", "right"))
    genome = controller(np.resize(SEES_WEIGHTS, (2, len(names))), interface)
    on = platform_of(spec_of(platform, files)).in_double().model_copy(update={"steps": STEPS})
    key, declared = NoiseKey(11), {"inputs": names, "outputs": ["left", "right"]}
    trial = trace_genome(on, paper_arena(), genome, noise=0.0, noise_key=key, inputs=names)
    env = gymnasium.make(
        "realitygap.gym:realitygap/ScribblerCoverage-v1",
        platform=on,
        noise=0.0,
        controller=declared,
        dtype="float64",
    )
    network = genome.network()
    seen, _ = env.reset(options={"noise_key": key})
    for step in range(STEPS):
        np.testing.assert_array_equal(seen, trial.inputs[step])
        assert env.observation_space.contains(seen)
        seen, *_, info = env.step(network.activate(seen))
        np.testing.assert_allclose(info["pose"][:2], trial.poses[step + 1, :2], atol=1e-12)
    env.close()


def test_environment_refuses_inputs_that_are_not_there(files):
    for platform in ("jyro", f"twin:{files / 'close.toml'}"):
        with pytest.raises(ValueError, match=r"light\.0 is missing"):
            gymnasium.make(
                "realitygap.gym:realitygap/ScribblerCoverage-v1",
                platform=platform,
                controller={"inputs": ["light.0"]},
            )
    with pytest.raises(ValueError, match=r"task\.inputs and controller\.inputs both"):
        gymnasium.make(
            "realitygap.gym:realitygap/Avoid-v0",
            task={"inputs": ["range.0"]},
            controller={"inputs": ["range.0"]},
        )


def test_ensemble_of_sim_drives_the_trials_of_the_declaration():
    platform, arena, genome = SimPlatform(), paper_arena(), controller(SEES_WEIGHTS, SEES)
    start = [*arena.start]
    driven = SimEnsemble(platform, arena).drive([genome], [start], STEPS, {}, 7)
    on = platform.model_copy(update={"steps": STEPS})
    track = trace_genome(on, arena, genome, noise=0.0, noise_key=NoiseKey(7), inputs=SEES.inputs)
    np.testing.assert_allclose(driven.poses[0, 0, :, :2], track.poses[:, :2], atol=1e-5)
    np.testing.assert_allclose(driven.commands[0, 0], track.commands, atol=1e-6)
    other = controller(SEES_WEIGHTS[:, :3], ControllerInterface(PAPER))
    with pytest.raises(ValueError, match="expected genomes of one kind"):
        SimEnsemble(platform, arena).drive([genome, other], [start] * 2, STEPS, {}, 7)


class Page:
    """What a live view sends to."""

    def send(self, content: dict) -> None:
        """Ignore it."""

    def on_msg(self, handler: object) -> None:
        """Ignore it."""


def test_live_view_passes_the_chosen_sensors_on():
    arena = paper_arena()
    network = controller(SEES_WEIGHTS, SEES).network()
    plain = drive_trial(SimRobot(SimPlatform(), arena), network, STEPS, interface=SEES)
    with WatchedRobot(SimRobot(SimPlatform(), arena), arena=arena, page=Page(), speed=None) as watched:
        assert "encoder.0" in watched.channels
        shown = drive_trial(watched, network, STEPS, interface=SEES)
    for name in ("commands", "readings", "stalled", "raw"):
        np.testing.assert_array_equal(getattr(shown, name), getattr(plain, name))


GAP_STUDY = """
[study]
name = "wheels"
replicates = 3
[controller]
inputs = ["range.0", "range.2", "encoder.0", "time", "bias"]
outputs = ["left", "right"]
[neat]
population = 6
generations = 2
[platform.{platform}]
steps = {steps}
[[condition]]
name = "c"
platform = "{platform}"
"""


@pytest.mark.slow
def test_gap_and_transfer_drive_champions_as_they_declare(files, tmp_path):
    study = parse_study(GAP_STUDY.format(platform="sim", steps=12), "wheels.toml")
    run_study(study, tmp_path / "results", threads=1)
    twin = f"twin:{files / 'close.toml'}"
    gap_between("sim", twin, controllers=tmp_path / "results", n_controllers=3, trials=2)
    with pytest.raises((ControllerError, StudyError), match=r"encoder\.0 is missing"):
        gap_between("jyro", twin, controllers=tmp_path / "results", n_controllers=3, trials=2)
    with open_target(twin, paper_arena()) as target:
        transfer(
            study,
            target,
            ("plain", "noise", "direct"),
            2,
            out=tmp_path / "out",
            runs=2,
            repeats=2,
            fresh_trials=2,
        )
    for path in (tmp_path / "out" / "champions").glob("*.json"):
        interface = Genome.load(path).interface
        assert (interface.inputs[2], interface.outputs) == ("encoder.0", ("left", "right"))


def test_physical_study_drives_networks_as_they_declare(tmp_path):
    study = parse_study(GAP_STUDY.format(platform="scribbler", steps=4), "wheels.toml")
    study = study.model_copy(update={"about": study.about.model_copy(update={"replicates": 1})})
    result = drive_study(study, "emulator://s2?fluke=2&speed=off", tmp_path / "results")
    assert result.physical.n_complete == 1


# the page

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "controllers.md"


def test_page_lists_the_inputs_of_each_platform():
    lines = PAGE.read_text("utf-8").split("## Outputs")[0].splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| `")]
    listed = {name.strip("` ").removesuffix(".K"): row[2:] for row in rows for name in row[0].split(",")}
    robots = [
        SimPlatform(robot=robot) for robot in ("scribbler-s2-fluke2", "khepera", "e-puck", "pioneer", "jyro")
    ]

    def kinds(inputs) -> set[str]:
        return {"bias", *(name.partition(".")[0] for name in inputs)}

    some = set.union(*(kinds(robot.inputs(ROOM)) for robot in robots))
    every = set.intersection(*(kinds(robot.inputs(paper_arena())) for robot in robots))
    here = {
        "jyro": kinds(JyroPlatform().inputs(ROOM)),
        "twin": kinds(TwinPlatform().inputs(ROOM)),
        "scribbler": kinds(ScribblerPlatform().inputs(ROOM)),
    }
    assert set(listed) == some.union(*here.values(), {"bump"})
    for name, (on_jyro, on_sim, on_twin, on_scribbler) in listed.items():
        for platform, said in (("jyro", on_jyro), ("twin", on_twin), ("scribbler", on_scribbler)):
            is_optional = platform == "twin" and name in ("light", "line")
            there = "file" if is_optional else "yes"
            assert said == (there if name in here[platform] else "no"), (name, platform)
        assert (on_sim == "yes") <= (name in every)
        assert (on_sim == "arena") == name.startswith("goal_")


@pytest.mark.slow
def test_example_of_wheels_is_a_study():
    study = load_study(PAGE.parents[2] / "examples" / "wheels.toml")
    assert [condition.output_names for condition in study.conditions] == [("left", "right")] * 3
    assert "encoder.1" in study.conditions[2].network_inputs

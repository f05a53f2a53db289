"""Twins as files and as draws from families."""

import hashlib

import pytest

from realitygap.errors import DescriptionError
from realitygap.robots.twin import EVERY, FAMILIES, Range, TwinModel, family_rows, load_twin, sample_twin


def write(tmp_path, text, *, format_line='format = "realitygap twin 1"\n'):
    path = tmp_path / "twin.toml"
    path.write_text(format_line + text, "utf-8")
    return path


@pytest.mark.parametrize("family", FAMILIES)
def test_a_file_gives_the_twin_that_it_was_written_from(family, tmp_path):
    model = sample_twin(family, 3)
    path = tmp_path / "twin.toml"
    path.write_text(model.to_toml(), "utf-8")
    assert load_twin(path) == model


def test_every_value_of_a_file_stands_below_its_meaning():
    lines = sample_twin("alien", 2).to_toml().splitlines()
    without = [
        line
        for above, line in zip(["", *lines], lines, strict=False)
        if " = " in line and not line.startswith("#") and not above.startswith("#")
    ]
    # only the second and third mount, whose keys were explained with the first
    assert set(without) <= {"x = 0.089", "y = 0.0", "direction = 0.0", "gain = 1.0"}


DAMAGED = ("weak-wheel", "dead-wheel", "blind-sensor", "payload", "stuck-caster")


@pytest.mark.parametrize(
    ("families", "digest"),
    [
        ([family for family in FAMILIES if family not in DAMAGED], "05bf551cfe1effc7"),
        (FAMILIES, "4750848f11a937e4"),
    ],
)
def test_a_twin_is_the_same_on_every_machine(families, digest):
    text = "".join(
        sample_twin(family, seed).model_dump_json() for family in families for seed in (0, 1, 2**63 - 1)
    )
    assert hashlib.sha256(text.encode()).hexdigest()[:16] == digest


def test_twins_of_other_seeds_are_other_ones():
    assert len({sample_twin("close", seed).motors.gain_left for seed in range(50)}) > 40


@pytest.mark.parametrize("family", FAMILIES)
def test_all_numbers_of_a_family_lie_within_its_limits_and_use_them(family):
    drawn = [sample_twin(family, seed).model_dump() for seed in range(100)]
    for name, low, high, part in family_rows(family):
        if part != family:
            continue
        values = [at(model, name) for model in drawn]
        if isinstance(low, str):
            assert set(values) == {low}
            continue
        assert low <= min(values) < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < max(values) <= high


def at(values, name):
    for key in name.split("."):
        values = values[int(key)] if key.isdigit() else values[key]
    return values


def test_an_alien_has_two_oddities_and_every_one_comes_up():
    counts = dict.fromkeys(FAMILIES["alien"].oddities, 0)
    plain = TwinModel().model_dump()
    for seed in range(100):
        model = sample_twin("alien", seed).model_dump()
        found = []
        for part, numbers in FAMILIES["alien"].oddities.items():
            first = next(name for name in numbers if name.startswith("oddities."))
            top = first.split(".")[1]
            if model["oddities"][top] != plain["oddities"][top]:
                found.append(part)
        assert len(found) == 2
        for part in found:
            counts[part] += 1
    assert min(counts.values()) > 10


@pytest.mark.parametrize(
    ("family", "broken"),
    [
        (
            "weak-wheel",
            lambda twin: [gain < 0.75 for gain in (twin.motors.gain_left, twin.motors.gain_right)],
        ),
        ("dead-wheel", lambda twin: [gain == 0 for gain in (twin.motors.gain_left, twin.motors.gain_right)]),
        ("blind-sensor", lambda twin: [mount.gain == 0 for mount in twin.ir.mount]),
    ],
)
def test_one_part_of_a_damaged_twin_is_broken_and_each_comes_up(family, broken):
    drawn = [broken(sample_twin(family, seed)) for seed in range(60)]
    assert {sum(each) for each in drawn} == {1}
    # of three parts, one that is never drawn in 60 would be a chance of 1 in 10 billion
    assert all(map(any, zip(*drawn, strict=True)))


def test_every_twin_draws_the_common_numbers_unless_its_family_has_its_own():
    worn = sample_twin("worn", 5)
    assert EVERY["ir.half"].low <= worn.ir.half <= EVERY["ir.half"].high
    assert isinstance(FAMILIES["worn"].numbers["motors.lag"], Range)
    assert worn.motors.lag > EVERY["motors.lag"].low


def test_only_the_engine_of_same_is_not_mujoco():
    assert {family for family in FAMILIES if sample_twin(family, 1).engine == "sim"} == {"same"}


def test_an_unknown_family_is_refused_with_what_may_be_meant():
    with pytest.raises(ValueError, match=r"Unknown family 'wron'\. Did you mean 'worn'"):
        sample_twin("wron", 1)
    with pytest.raises(ValueError, match="-1"):
        sample_twin("worn", -1)


def test_keys_may_end_in_units(tmp_path):
    path = write(tmp_path, "[wheels]\ntrack_mm = 150\n[ir]\nhalf_in = 4\ncone_deg = 10\n")
    model = load_twin(path)
    assert model.wheels.track == pytest.approx(0.150)
    assert model.ir.half == pytest.approx(0.1016)
    assert model.ir.cone == pytest.approx(0.17453, abs=1e-5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[wheels]\ntrack = -1\n", "wheels.track: expected at least 0.05, got -1"),
        ("[wheels]\ntrak = 0.15\n", "wheels.trak: unknown setting. Did you mean 'track'"),
        ("[motors]\nspeed = 'fast'\n", "motors.speed: expected a number, got 'fast'"),
        ("[motors]\nahead = 2\n", "motors.ahead: expected 1 or -1, got 2"),
        ("[motors]\ntorque = nan\n", "motors.torque: expected a finite number"),
        ("[body]\ncenter = -0.03\n", "body.center is -0.03, expected it between wheels.axle"),
        (
            "[body]\ncorners = [[0.1, 0.1], [0.1, -0.1], [-0.1, -0.1]]\n",
            "its corners go clockwise",
        ),
        ("[body]\ncorners = [[0.1, 0.1]]\n", "body.corners: expected"),
        ("[body]\ncardboard = [0.2]\n", "body.cardboard"),
        ("[ir]\nrays = 0\n", "ir.rays: expected at least 1, got 0"),
        ("[[ir.mount]]\nz = 1\n", "ir.mount.0.z: unknown setting"),
        ("[oddities.patch]\nx = 0.1\n", "oddities.patch.y: missing"),
        ("engine = 'jyro'\n", "engine: expected 'mujoco' or 'sim', got 'jyro'"),
        ("wheels = 3\n", "wheels: expected a table, got 3"),
        ("[wheels]\ntrack_mm = 150\ntrack = 0.15\n", "track: given twice"),
        ("[wheels\n", "not TOML"),
    ],
)
def test_a_mistake_in_a_file_is_told_with_its_place(text, said, tmp_path):
    with pytest.raises(DescriptionError) as caught:
        load_twin(write(tmp_path, text))
    assert said in str(caught.value)
    assert str(tmp_path / "twin.toml") in str(caught.value)


def test_all_mistakes_are_told_at_once(tmp_path):
    with pytest.raises(DescriptionError, match=r"has 2 mistakes(.|\n)*friction(.|\n)*lag"):
        load_twin(write(tmp_path, "[wheels]\nfriction = -1\n[motors]\nlag = -1\n"))


def test_a_file_of_something_else_is_refused(tmp_path):
    with pytest.raises(DescriptionError, match="is no twin file"):
        load_twin(write(tmp_path, "[wheels]\n", format_line=""))
    with pytest.raises(DescriptionError, match="format: expected 'realitygap twin 1'"):
        load_twin(write(tmp_path, "", format_line='format = "realitygap twin 9"\n'))
    with pytest.raises(DescriptionError, match=r"There is no twin file .*twin sample"):
        load_twin(tmp_path / "none.toml")

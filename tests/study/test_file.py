"""Study files: read by name and by path, mistakes said all at once."""

import numpy as np
import pytest

from realitygap.errors import StudyError
from realitygap.study import Study, load_study, named_studies, parse_study

MINIMAL = """
[study]
name = "mine"
[[condition]]
name = "a"
"""


def mistakes(text: str) -> list[str]:
    with pytest.raises(StudyError) as caught:
        parse_study(text, "mine.toml")
    head, *lines = str(caught.value).split("\n  ")
    assert head == f"mine.toml has {len(lines)} mistake{'s' if len(lines) != 1 else ''}; nothing was run."
    return lines


def test_paper_study_is_table_1_of_the_paper():
    study = load_study("paper")
    assert [condition.name for condition in study.conditions] == [
        f"{selection}-{noise}" for selection in ("coverage", "novelty", "random") for noise in (10, 50, 80)
    ]
    for condition in study.conditions:
        selection, noise = condition.name.split("-")
        assert condition.selection == selection
        assert condition.noise == int(noise) / 100
        assert (condition.neat.population, condition.neat.generations) == (8, 5)
        assert (condition.neat.add_link, condition.neat.add_node) == (0.1, 0.05)
        assert condition.on.steps == 87
        assert condition.has_bias_input == (selection == "novelty")
        assert condition.neat_rules.n_inputs == (4 if selection == "novelty" else 3)
        assert condition.neat_rules.n_outputs == 2
    assert study.about.replicates == 100


def test_paper_values_are_those_of_table_2():
    notes = dict(
        zip((c.name for c in load_study("paper").conditions), load_study("paper").notes, strict=True)
    )
    assert "section 3.2 (novelty)" in load_study("paper").about.note
    table_2 = {10: [0.154, 0.222, 0.166], 50: [0.208, 0.432, 0.389], 80: [0.180, 0.333, 0.333]}
    for noise, values in table_2.items():
        assert notes[f"novelty-{noise}"].published == values
        assert notes[f"coverage-{noise}"].published == values
        assert notes[f"coverage-{noise}"].published_source == f"Table 2, {noise}% noise"
        assert notes[f"random-{noise}"].published is None


def flat(values: dict, place: str = "") -> dict[str, object]:
    found: dict[str, object] = {}
    for key, value in values.items():
        where = f"{place}.{key}".removeprefix(".")
        found |= flat(value, where) if isinstance(value, dict) else {where: value}
    return found


def test_paper_choices_change_one_choice_at_a_time():
    study = load_study("paper-choices")
    by_name = {condition.name: flat(condition.settings()) for condition in study.conditions}
    together = {  # one choice that takes several settings
        "coverage-sigmoid": {"neat.activation", "neat.activation_slope"},
        "coverage-neat-python": {
            "neat.settings",
            "neat.node_bias",
            "neat.activation_slope",
            "neat.structural_mutations",
            "neat.split_bias_links",
        },
    }
    for condition, notes in zip(study.conditions, study.notes, strict=True):
        if notes.baseline is None:
            assert notes.change is None
            continue
        ours, base = by_name[condition.name], by_name[notes.baseline]
        changed = {key for key in ours if ours[key] != base[key]}
        assert notes.change
        assert changed == together.get(condition.name, changed)
        assert len(changed) == 1 or condition.name in together, (condition.name, changed)


@pytest.mark.parametrize(
    ("setting", "alternatives"),
    [
        ("neat.activation", {"tanh", "sigmoid"}),
        ("arena.start", {"corner", "center", "left"}),
        ("task.cells", {"line", "ends"}),
        ("jyro.noisy_reading", {"leave", "clip"}),
        ("jyro.steps", {87, 70}),
        ("neat.settings", {"rosenzweig-remy", "rosenzweig-remy-neat-python"}),
        ("novelty.enter", {"above-all", "above-least"}),
        ("novelty.kind", {"paper", "lehman-stanley"}),
        ("novelty.sort", {"x-then-y", "y-then-x"}),
    ],
)
def test_paper_choices_try_every_alternative(setting, alternatives):
    tried = {flat(condition.settings())[setting] for condition in load_study("paper-choices").conditions}
    assert tried == alternatives


@pytest.mark.parametrize(
    "setting",
    [
        "jyro.sensor_offset",
        "jyro.turn_per_step",
        "novelty.archive_size",
        "task.bias_input",
        "neat.initial_weight",
        "neat.weight_step",
        "neat.replace_weight",
        "neat.threshold",
    ],
)
def test_paper_choices_vary_every_number(setting):
    tried = {flat(condition.settings())[setting] for condition in load_study("paper-choices").conditions}
    assert len(tried) > 1


def test_all_mistakes_are_said_at_once_each_with_its_place():
    lines = mistakes(
        """
        sede = 1
        [study]
        name = "a b"
        replicates = "many"
        sede = 3
        [neat]
        settings = "stanly"
        populaton = 3
        add_link = 2
        [arena]
        start = "middle"
        [platform.jyrp]
        [[condition]]
        name = "x"
        noise = "high"
        selection = "covrage"
        baseline = "y"
        [condition.neat]
        population = 1
        [[condition]]
        [[condition]]
        name = "x"
        [condition.arena]
        preset = "papr"
        """
    )
    expected = [
        ("sede", "unknown section"),
        ("study.name", "expected letters"),
        ("study.replicates", "expected a whole number, got 'many'"),
        ("study.sede", "Did you mean 'seed'?"),
        ("platform.jyrp", "Did you mean 'jyro'?"),
        ("arena.start", "got 'middle'"),
        ("neat.settings", "Did you mean 'stanley-2002'?"),
        ("neat.populaton", "Did you mean 'population'?"),
        ("neat.add_link", "expected at most 1.0, got 2"),
        ("condition[1] 'x'.noise", "expected a number, got 'high'"),
        ("condition[1] 'x'.selection", "Did you mean 'coverage'?"),
        ("condition[1] 'x'.neat.population", "expected at least 2, got 1"),
        ("condition[2].name", "missing"),
        ("condition[3] 'x'.name", "an earlier condition has this name"),
        ("condition[3] 'x'.arena.preset", "got 'papr'"),
    ]
    for place, text in expected:
        assert any(line.startswith(f"{place}: ") and text in line for line in lines), (place, text, lines)
    assert len(lines) == len(expected)


@pytest.mark.parametrize(
    ("change", "place", "text"),
    [
        ('noise = "a"', "condition[1] 'a'.noise", "expected a number"),
        ("noise = nan", "condition[1] 'a'.noise", "expected a finite number"),
        ("noise = true", "condition[1] 'a'.noise", "expected a number"),
        ("noise = -0.1", "condition[1] 'a'.noise", "expected at least 0"),
        ('platform = "tank"', "condition[1] 'a'.platform", "got 'tank'"),
        ('platform = "twin"', "condition[1] 'a'", "expected twin:FILE"),
        ('platform = "sim:no.toml"', "condition[1] 'a'.platform", "There is no robot file no.toml."),
        ('platform = "sim:thymyo"', "condition[1] 'a'.platform", "Did you mean 'thymio'?"),
        ('platform = "twin:no.toml"', "condition[1] 'a'", "the twin's file 'no.toml' cannot be read"),
        ('baseline = "b"', "condition 'a'.baseline", "there is no condition 'b'"),
        ("published = [0.1, 2]", "condition[1] 'a'.published[2]", "expected at most 1.0, got 2."),
        ('published = ["x"]', "condition[1] 'a'.published[1]", "expected a number, got 'x'."),
        ('arena.start = [0.3, "x", 0.0]', "condition[1] 'a'.arena.start", "a number as value 2"),
        ('change = "a\\u0007b"', "condition[1] 'a'.change", "without control characters"),
        ("wheels = 2", "condition[1] 'a'.wheels", "unknown setting"),
        ("neat = 3", "condition[1] 'a'.neat", "expected a table"),
        ("arena.start = [9.0, 0.3, 0.0]", "condition[1] 'a'.arena.start", "outside the arena"),
        ("arena.start = [0.1, 0.3]", "condition[1] 'a'.arena.start", "expected"),
        ("arena.start = [0.1, 0.05, 0.0]", "condition[1] 'a'", "does not fit at the start"),
        ("jyro.steps = 0", "condition[1] 'a'.jyro.steps", "expected at least 1"),
        ("neat.settings = []", "condition[1] 'a'.neat.settings", "unknown set []"),
        (
            "neat.population = 1000000\nneat.generations = 1000000",
            "condition[1] 'a'",
            "1,000,000,000,000 trials a run, expected at most 5,000,000",
        ),
        ("novelty.archive_size = 0", "condition[1] 'a'.novelty.archive_size", "expected at least 1"),
    ],
)
def test_a_mistake_in_a_condition_is_said_with_its_place(change, place, text):
    (line,) = mistakes(MINIMAL + change)
    assert line.startswith(f"{place}: ")
    assert text in line


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[study", "not TOML"),
        ("", "study: missing"),
        ('[study]\nname = "x"', "at least one [[condition]]"),
        ('[study]\nname = "x"\n[condition]\nname = "y"', "at least one [[condition]]"),
        ('study = "x"\n[[condition]]\nname = "y"', "study: expected a table"),
    ],
)
def test_a_file_that_is_no_study_is_refused(text, message):
    with pytest.raises(StudyError, match=r"mine\.toml") as caught:
        parse_study(text, "mine.toml")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "change",
    [
        'platform = "sim:no.toml"',
        'platform = "twin:no.toml"',
        'platform = "sim:thymio"',  # which has no number light.0.gain
        'platform = "sim"\ntask.kind = "goal"\nsim.robot = "no.toml"',
    ],
)
def test_condition_with_a_mistake_is_never_left_out(change):
    """A condition with a missing robot file vanished, and the rest of the study ran."""
    text = MINIMAL + f'[[condition]]\nname = "b"\n{change}\n[[condition]]\nname = "c"\nplatform = "sim"\n'
    lines = mistakes(text + '[platform.sim.set]\n"light.0.gain" = 1.1\n')
    assert any(line.startswith("condition[2] 'b'") for line in lines), lines


def test_numbers_of_robot_and_arena_are_wrong_at_once():
    text = """
    [study]
    name = "s"
    [platform.sim.set]
    "drive.trak" = 0.1
    "arena.start.z" = 1.0
    [[condition]]
    name = "a"
    platform = "sim"
    """
    with pytest.raises(StudyError) as caught:
        parse_study(text, "s.toml")
    assert [line.strip() for line in str(caught.value).splitlines()] == [
        "s.toml has 2 mistakes; nothing was run.",
        "platform.sim.set: drive.trak: no number of this name. Did you mean 'drive.track'?",
        "condition[1] 'a'.sim.set: arena.start.z: no number of this name. Did you mean 'arena.start.y'?",
    ]


def test_consequences_of_a_mistake_are_not_reported():
    """`study = 4` was said to lack a name, too."""
    assert mistakes('study = 4\n[[condition]]\nname = "y"') == ["study: expected a table, got 4."]
    assert mistakes('condition = [3]\n[study]\nname = "x"') == ["condition[1]: expected a table, got 3."]


def test_the_same_mistake_in_a_shared_section_is_said_once():
    text = MINIMAL + '[[condition]]\nname = "b"\n[neat]\nadd_link = 7\n'
    assert mistakes(text) == ["neat.add_link: expected at most 1.0, got 7."]


def test_a_set_of_settings_that_is_no_name_is_one_mistake():
    """A list for a name ended in a traceback."""
    (line,) = mistakes(MINIMAL + "[neat]\nsettings = []\n")
    assert line.startswith("neat.settings: unknown set []. Known: default")


def test_unknown_study_names_the_nearest():
    with pytest.raises(StudyError, match="Did you mean 'paper'"):
        load_study("papr")


def test_missing_file_says_how_to_write_one():
    with pytest.raises(StudyError, match="new-study"):
        load_study("nowhere/mine.toml")


def test_binary_file_is_refused(tmp_path):
    path = tmp_path / "x.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(StudyError, match=r"x\.toml is not a text file in UTF-8 \(byte 0 is not\)"):
        load_study(path)


def test_a_folder_is_no_study_file(tmp_path):
    with pytest.raises(StudyError, match=r"cannot be read: Is a directory\. Expected a study file"):
        load_study(tmp_path)


def test_no_name_is_an_unknown_one():
    with pytest.raises(StudyError, match="Unknown study ''"):
        load_study("")


@pytest.mark.parametrize("study", [None, 3, {}, ["paper"]])
def test_a_study_that_is_neither_a_name_nor_a_path_is_refused(study):
    with pytest.raises(TypeError, match="expected the name of one, or the path of a study file"):
        load_study(study)


def test_advice_can_be_pasted_into_a_shell():
    with pytest.raises(StudyError, match=r"`realitygap new-study 'my studies/a\.toml'`"):
        load_study("my studies/a.toml")


def test_numpy_s_whole_numbers_are_taken():
    study = load_study("paper", seed=np.int64(4), replicates=np.uint8(7))
    assert study == load_study("paper", seed=4, replicates=7)
    with pytest.raises(StudyError, match="replicates is True, expected a whole number"):
        load_study("paper", replicates=True)


@pytest.mark.parametrize("key", ["title", "note"])
@pytest.mark.parametrize("letters", ["\\n", "\\u001b[31m", "\\u0000"])
def test_a_line_has_no_control_characters(key, letters):
    """They went to the terminal and into the report as they were."""
    (line,) = mistakes(f'[study]\nname = "x"\n{key} = "a{letters}b"\n[[condition]]\nname = "a"')
    assert line.startswith(f"study.{key}: expected a text on one line, without control characters, got 'a")


def test_conditions_whose_files_some_disks_take_for_one_are_refused():
    (line,) = mistakes(MINIMAL + '[[condition]]\nname = "A"')
    assert line.startswith("condition[2] 'A'.name: differs from 'a' in capitals only")


def test_a_study_made_in_python_is_whole():
    study = parse_study(MINIMAL, "mine.toml")
    parts = {"about": study.about, "report": study.report, "conditions": study.conditions}
    with pytest.raises(ValueError, match="there are 0 notes, expected 1: one a condition"):
        Study(**parts, notes=())
    both = (study.conditions[0], study.conditions[0].model_copy(update={"name": "A"}))
    with pytest.raises(ValueError, match="conditions 'a' and 'A' would share files"):
        Study(**{**parts, "conditions": both}, notes=study.notes * 2)


def test_conditions_override_sections_and_named_sets_fill_the_rest():
    study = parse_study(
        """
        [study]
        name = "mine"
        [neat]
        settings = "stanley-2002"
        population = 20
        add_node = 0.2
        [platform.jyro]
        steps = 50
        [[condition]]
        name = "base"
        [[condition]]
        name = "other"
        [condition.neat]
        settings = "rosenzweig-remy"
        add_node = 0.3
        [condition.jyro]
        turn_per_step = 0.5
        """,
        "mine.toml",
    )
    base, other = study.conditions
    assert (base.neat.settings, base.neat.population, base.neat.add_node) == ("stanley-2002", 20, 0.2)
    assert base.neat.activation == "sigmoid"
    assert (other.neat.settings, other.neat.population, other.neat.add_node) == ("rosenzweig-remy", 20, 0.3)
    assert other.neat.activation == "tanh"
    assert (base.on.steps, base.on.turn_per_step) == (50, 0.1)
    assert (other.on.steps, other.on.turn_per_step) == (50, 0.5)


def test_seed_and_replicates_can_be_given_beside_the_file():
    study = load_study("paper", seed=9, replicates=3)
    assert study.about.replicates == 3
    assert {condition.seed for condition in study.conditions} == {9}


def test_a_wrong_seed_beside_the_file_is_said():
    with pytest.raises(StudyError, match=r"^replicates is 0, expected 1 to"):
        load_study("paper", replicates=0)


def test_every_named_study_resolves():
    assert {"distances", "paper", "paper-choices", "paper-robot", "sim-paper"} <= set(named_studies())
    for name in named_studies():
        assert load_study(name).about.name == name


def test_settings_of_a_platform_that_no_condition_is_on_are_refused():
    """The study ran on jyro, without a message."""
    text = '[study]\nname = "a"\n[platform.sim]\nrobot = "khepera"\n[[condition]]\nname = "a"\n{}\n'
    with pytest.raises(
        StudyError, match=r'platform\.sim: no condition is on this platform\. Write platform = "sim"'
    ):
        parse_study(text.format(""), "a.toml")
    assert parse_study(text.format('platform = "sim"'), "a.toml").conditions[0].on.robot.name == "khepera"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[[body]]\nbox = [1, 1]", "is a robot file, .*robot = 'x.toml'"),
        ("wall = []", "is an arena file, .*'x.toml'"),
    ],
)
def test_a_file_of_a_robot_or_an_arena_is_named_as_such(text, expected):
    with pytest.raises(StudyError, match=expected):
        parse_study(text, "x.toml")

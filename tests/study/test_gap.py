"""The same controllers on both sides of a gap, resumable, with what is not the transfer gap kept apart."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from realitygap.errors import RecordError, RobotError, StudyError
from realitygap.gap import GapSide
from realitygap.platforms import SimPlatform, SimTarget
from realitygap.records import EndReason, read_observations
from realitygap.study import (
    gap_between,
    open_target,
    recorded_spreads,
    sample_controllers,
    try_on,
)
from realitygap.study._controllers import Controller
from realitygap.study._gap import between as study_gap_between
from realitygap.study._gap.study import study_gap
from realitygap.study._gap.why import PARTS, part_of, why_gap
from realitygap.world import Calibration, paper_arena

pytestmark = pytest.mark.slow

ARENA = paper_arena()


@dataclass
class Counted:
    """A target that counts what it is asked, and stops working after so many trials."""

    target: SimTarget
    fails_after: int = 10**9
    asked: list[int] = field(default_factory=list)

    def __getattr__(self, name):
        return getattr(self.target, name)

    def carry_out(self, plans, observe, tell=None):
        trials = []
        for k, plan in enumerate(plans):
            if len(self.asked) >= self.fails_after:
                raise RecordError("the power went")
            self.asked.append(plan.number)
            trials += self.target.carry_out([plan], observe)
            if tell is not None:
                tell(k, trials[-1])
        return trials


@pytest.fixture(scope="module")
def some():
    return sample_controllers("random", 6, 1)


def run_gap(*platforms_and_controllers, **settings):
    return study_gap(*platforms_and_controllers, **settings).result


def sim(key=1, **settings):
    return SimTarget(SimPlatform(set=settings), ARENA, key=key, name="sim")


# controllers


def test_random_controllers_are_a_function_of_the_seed_and_those_of_fewer_are_the_first():
    many, few = sample_controllers("random", 12, 3), sample_controllers("random", 5, 3)
    assert [each.genome for each in few] == [each.genome for each in many[:5]]
    assert few[0].genome != sample_controllers("random", 5, 4)[0].genome


def test_champions_of_a_study_have_the_score_they_were_selected_for_and_a_fresh_one():
    found = sample_controllers("paper", 8, 1)
    assert all(each.kind == "champion" and each.selected_on == "jyro" for each in found)
    assert np.mean([each.selected_score - each.fresh_score for each in found]) > 0
    assert found[0].name == "coverage-10/0"


def test_champions_of_results_are_drawn_from_all_runs(tmp_path):
    from realitygap.study import run_study

    folder = run_study("paper", tmp_path / "results", replicates=3).folder.path
    found = sample_controllers(str(folder), 6, 1)
    assert len({each.name for each in found}) == 6
    assert found == sample_controllers(folder, 6, 1)
    with pytest.raises(StudyError, match="Add runs"):
        sample_controllers(folder, 1_000)


def test_a_study_that_is_not_there_is_refused():
    with pytest.raises(StudyError, match="Unknown study"):
        sample_controllers("papper", 3)


# trials


def test_two_sims_show_no_gap_and_never_draw_the_same_noise(some):
    found = study_gap(sim(), sim(), some, trials=4, margin=0.05)
    assert not found.result.excludes_no_gap
    assert found.result.equivalence.more["equivalent"] is True
    assert not np.array_equal(found.source.values, found.target.values)


def test_30_pairs_of_sims_exclude_no_gap_at_most_4_times():
    # each interval of 95 % excludes it in 1 of 20: more than 4 of 30 in 1 of 60 tries
    excluded = 0
    for seed in range(30):
        controllers = sample_controllers("random", 12, seed)
        level = run_gap(sim(2 * seed), sim(2 * seed + 1), controllers, trials=5, seed=seed)
        excluded += level.excludes_no_gap or not level.level.low <= 0 <= level.level.high
    assert excluded <= 4


def test_jyro_is_a_real_gap():
    found = gap_between("sim", "jyro", n_controllers=12, trials=4, margin=0.02)
    assert found.study.result.excludes_no_gap
    assert found.study.result.energy.more["p"] < 0.01
    assert found.study.result.equivalence.more["equivalent"] is not True


def test_trials_go_round_the_controllers(some):
    target = Counted(sim())
    run_gap(sim(), target, some[:3], trials=2)
    assert np.diff(target.asked).tolist() == [4096, 4096, 1 - 2 * 4096, 4096, 4096]


def test_saved_trials_are_not_repeated_and_give_the_same_result(some, tmp_path):
    path = tmp_path / "trials.sqlite"
    whole = run_gap(sim(), sim(), some, trials=3)
    with pytest.raises(RecordError, match="power"):
        run_gap(sim(), Counted(sim(), fails_after=7), some, trials=3, results=path)
    again = Counted(sim())
    assert run_gap(sim(), again, some, trials=3, results=path).to_json() == whole.to_json()
    assert len(again.asked) == 18 - 7
    more = Counted(sim())
    run_gap(sim(), more, some, trials=4, results=path)
    assert len(more.asked) == 6


def test_a_file_of_another_target_is_refused(some, tmp_path):
    path = tmp_path / "trials.sqlite"
    run_gap(sim(), sim(), some, trials=2, results=path)
    with pytest.raises(RecordError, match="another kind"):
        run_gap(sim(), open_target("jyro", ARENA), some, trials=2, results=path)


def calibrated(path, **more):
    made = Calibration(
        kind="all", robot="scribbler-s2-fluke2", target="a", label="SIM", observe="cells", trials=1, date="2026-01-01",
        method="known", numbers={"drive.track": 0.15}, **more,
    )  # fmt: skip
    path.write_text(made.to_toml())
    return f"sim:{path}"


def test_commands_of_an_uncalibrated_sim_last_as_long_as_the_robots(tmp_path):
    """They lasted half a second against a robot whose commands last longer, which made a gap of its own."""
    slow = calibrated(tmp_path / "slow.toml", step_s=0.8)
    untimed = calibrated(tmp_path / "untimed.toml")
    timed = calibrated(tmp_path / "timed.toml", step_s=0.5)
    expected = {"sim": 0.8, untimed: 0.8, timed: 0.5, "jyro": 0.1}
    for spec, step_s in expected.items():
        found = gap_between(spec, slow, n_controllers=2, trials=2).study
        assert {trial.step_s for trial in found.source_trials} == {step_s}
        assert any("0.8 s in place of 0.5 s" in note for note in found.result.notes) is (step_s == 0.8)
    found = gap_between("sim", "jyro", n_controllers=2, trials=2).study
    assert {trial.step_s for trial in found.source_trials} == {0.5}


def test_replays_are_measured_where_the_robot_is_seen(some):
    found = study_gap(sim(), sim(**{"drive.track": 0.2}), some, trials=2, observe="track")
    assert found.replay.distance[:, 0] == pytest.approx(np.zeros(12), abs=1e-6)
    assert found.replay.heading[:, 10].mean() > 5 * found.replay.noise_heading[:, 10].mean()
    assert found.target.ends.shape == (6, 2, 2)
    assert study_gap(sim(), sim(), some, trials=2).replay is None


def test_luck_and_what_was_evolved_apart_are_no_part_of_the_transfer_gap(some):
    champions = [
        Controller(each.genome, f"c/{k}", selected_score=0.5, fresh_score=0.4, selected_on="sim")
        for k, each in enumerate(some)
    ]
    plain = run_gap(sim(), sim(), some, trials=2)
    apart = run_gap(sim(), sim(), champions, trials=2, reevolved=champions)
    assert apart.luck.value == pytest.approx(0.1)
    assert apart.reevolved.value == pytest.approx(apart.level.value, abs=0.03)
    assert plain.luck.value is None
    assert plain.reevolved.value is None
    assert apart.rms == plain.rms


def test_why_without_a_calibration_says_how_to_make_one():
    with pytest.raises(StudyError, match="calibrate all"):
        gap_between("sim", "jyro", why=True)


# why


def test_every_number_of_the_robot_is_of_one_part():
    parts = {part_of(name) for name in SimPlatform().robot.numbers()}
    assert parts == set(PARTS)
    assert part_of("drive.track") == "turn per step"
    assert part_of("drive.lag") == "motor"
    assert part_of("range.0.burst") == "sensor noise"


def test_the_part_that_differs_carries_the_gap():
    controllers = sample_controllers("random", 10, 1)
    hidden = {"drive.track": 0.21}
    gap = study_gap(sim(), sim(7, **hidden), controllers, trials=8)
    calibration = Calibration(
        kind="all", robot="scribbler-s2-fluke2", target="sim", label="SIM", observe="track", trials=1,
        date="2026-01-01", method="known", numbers={**hidden, "contact.friction": 0.3},
        draws={"drive.track": (0.209, 0.211), "contact.friction": (0.3, 0.3)},
    )  # fmt: skip
    found = why_gap(calibration, gap, draws=2, trials=4)
    falls = dict(zip(found.parts, found.falls, strict=True))
    assert found.after.value < 0.5 * found.before.value
    assert falls["turn per step"].value == pytest.approx(found.before.value - found.after.value, abs=1e-6)
    assert falls["contact"].value == 0.0  # the fit did not change it
    assert falls["body"].value == 0.0
    assert "Change this next: " in found.advice


def test_why_has_commands_last_as_long_as_in_the_gap():
    controllers = sample_controllers("random", 6, 1)
    gap = study_gap(sim(), sim(7), controllers, trials=2)
    calibration = Calibration(
        kind="path", robot="scribbler-s2-fluke2", target="twin", label="TWIN", observe="cells", trials=10, step_s=1.0,
        date="2026-01-01", method="known", numbers={"drive.track": 0.16},
    )  # fmt: skip
    slow, fast = (
        why_gap(calibration, replace(gap, step_s=step_s), trials=2).before.value for step_s in (1.0, 0.5)
    )
    assert slow != fast


def test_why_needs_numbers_to_switch_and_noise_to_tell(some):
    nothing = Calibration(
        kind="all", robot="scribbler-s2-fluke2", target="sim", label="SIM", observe="cells", trials=1,
        date="2026-01-01", method="known",
    )  # fmt: skip
    gap = study_gap(sim(), sim(), some, trials=2)
    with pytest.raises(StudyError, match="changes no number"):
        why_gap(nothing, gap)
    with pytest.raises(StudyError, match="one trial"):
        why_gap(nothing, replace(gap, target=GapSide("t", "SIM", np.zeros((6, 1)))))


@pytest.mark.long
def test_a_slippery_twin_is_a_gap_and_one_of_the_family_same_is_none(tmp_path):
    pytest.importorskip("mujoco", reason="twins need the extra twin")
    from realitygap.robots.twin import sample_twin

    found = {}
    for family in ("slippery", "same"):
        file = tmp_path / f"{family}.toml"
        file.write_text(sample_twin(family, 1).to_toml(), "utf-8")
        found[family] = gap_between("sim", f"twin:{file}", n_controllers=8, trials=4).study.result
    assert found["slippery"].labels == ("SIM", "TWIN")
    assert found["slippery"].excludes_no_gap
    assert not found["same"].excludes_no_gap


@dataclass
class Interrupted(Counted):
    """Ctrl-C in the midst of a trial, which is told as far as it went."""

    def carry_out(self, plans, observe, tell=None):
        try:
            return super().carry_out(plans, observe, tell)
        except RecordError:
            (trial,) = self.target.carry_out([plans[self.fails_after]], observe)
            tell(self.fails_after, replace(trial, cells=(), end=str(EndReason.INTERRUPTED)))
            raise KeyboardInterrupt from None


def test_a_trial_that_was_cut_off_does_not_count_and_is_carried_out_again(some, tmp_path):
    """It counted as one that visited nothing."""
    path = tmp_path / "trials.sqlite"
    whole = run_gap(sim(), sim(), some, trials=3)
    with pytest.raises(KeyboardInterrupt):
        run_gap(sim(), Interrupted(sim(), fails_after=7), some, trials=3, results=path)
    kept = read_observations(path).trials
    assert [trial.end for trial in kept] == ["step limit"] * 7 + ["interrupted"]
    again = Counted(sim())
    assert run_gap(sim(), again, some, trials=3, results=path) == whole
    assert len(again.asked) == 18 - 7
    run_gap(sim(), sim(), some, trials=3, results=tmp_path / "whole.sqlite")
    assert recorded_spreads(str(path)).noise == pytest.approx(
        recorded_spreads(str(tmp_path / "whole.sqlite")).noise
    )


def test_a_trial_that_is_lost_for_good_is_no_trial_that_visited_nothing(some, tmp_path):
    class Skipping(Counted):
        def carry_out(self, plans, observe, tell=None):
            def told(k, trial):
                tell(k, trial if k else replace(trial, cells=(), end=str(EndReason.LOST)))

            trials = super().carry_out(plans, observe, told)
            return [replace(trials[0], cells=(), end=str(EndReason.LOST)), *trials[1:]]

    path = tmp_path / "trials.sqlite"
    with pytest.raises(RobotError, match="A trial on sim was lost"):
        run_gap(sim(), Skipping(sim()), some, trials=2)
    with pytest.raises(RobotError, match=r"The others are saved in .*trials.sqlite"):
        run_gap(sim(), Skipping(sim()), some, trials=2, results=path)
    again = Counted(sim())
    run_gap(sim(), again, some, trials=2, results=path)
    assert len(again.asked) == 1


def test_trials_of_a_robot_have_to_be_kept(monkeypatch, tmp_path):
    real = sim()
    real.label = "REAL"
    there = study_gap_between.open_target
    monkeypatch.setattr(
        study_gap_between,
        "open_target",
        lambda spec, *more, **named: real if spec == "robot" else there(spec, *more, **named),
    )
    with pytest.raises(StudyError, match=r"12 trials on robot would not be saved.*results=FILE"):
        gap_between("sim", "robot", n_controllers=6, trials=2, noise=0)
    file = tmp_path / "trials.sqlite"
    found = gap_between("sim", "robot", n_controllers=6, trials=2, noise=0, results=file)
    assert found.study.target.label == "REAL"
    recorded = gap_between("sim", f"recorded:{file}", n_controllers=6, trials=2)
    assert recorded.study.target.label == "REAL"  # they are in a file already


def test_trials_of_one_controller_tell_no_gap(some, tmp_path):
    path = tmp_path / "one.sqlite"
    try_on(sim(), some[0].genome, trials=2, out=path)
    with pytest.raises(StudyError, match="of one controller, expected at least 2"):
        gap_between("sim", f"recorded:{path}")


def test_re_evolved_is_only_what_evolved_there(some):
    with pytest.raises(
        StudyError, match="random-0 of reevolved random was evolved nowhere, expected champions"
    ):
        gap_between("sim", "jyro", n_controllers=3, trials=1, reevolved="random")
    with pytest.raises(StudyError, match="random-0 of controllers random was evolved nowhere"):
        gap_between("sim", "jyro", n_controllers=2, trials=1, reevolved="paper")
    elsewhere = [
        replace(each, kind="champion", selected_score=0.5, fresh_score=0.4, selected_on="jyro")
        for each in some
    ]
    there = [replace(each, selected_on="sim") for each in elsewhere]
    assert (
        "were evolved on jyro"
        in run_gap(sim(), sim(), elsewhere, trials=2, reevolved=there).reevolved.refused
    )
    assert run_gap(sim(), sim(), there, trials=2, reevolved=there).reevolved.value is not None


def test_kept_trials_of_another_simulator_are_not_taken(some, tmp_path):
    """`sim` with other numbers, or another noise, was given the trials of the one before."""
    path = tmp_path / "trials.sqlite"
    run_gap(sim(), sim(), some, trials=1, results=path)
    with pytest.raises(RecordError, match="identity"):
        run_gap(sim(), sim(**{"drive.track": 0.17}), some, trials=1, results=path)
    with pytest.raises(RecordError, match=r"noise 0\.5"):
        run_gap(sim(), SimTarget(SimPlatform(), ARENA, 0.5, key=1, name="sim"), some, trials=1, results=path)
    again = Counted(sim())
    run_gap(sim(), again, some, trials=1, results=path)
    assert not again.asked


def test_why_and_the_papers_noise_are_not_put_together(tmp_path):
    calibration = Calibration(
        kind="path", robot="scribbler-s2-fluke2", target="twin", label="TWIN", observe="cells", trials=10,
        date="2026-01-01", method="known", numbers={"drive.track": 0.16},
    )  # fmt: skip
    (tmp_path / "fit.toml").write_text(calibration.to_toml())
    with pytest.raises(StudyError, match="without the paper's noise"):
        gap_between(f"sim:{tmp_path / 'fit.toml'}", "sim", why=True, noise=0.5, n_controllers=5, trials=2)

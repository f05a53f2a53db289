import numpy as np
import pytest

from realitygap.evolution import NeatSettings, Population
from realitygap.platforms import Play, SimEnsemble, SimPlatform, trace_genome
from realitygap.platforms.sim import _ensemble as module
from realitygap.trials import NoiseKey
from realitygap.world import paper_arena

pytestmark = pytest.mark.slow

START = [0.1905, 0.1905, 0.0]
ROBOT = SimPlatform().robot


@pytest.fixture(scope="module")
def genomes():
    return Population(3, 2, NeatSettings.named("rosenzweig-remy"), seed=4).ask()[:3]


@pytest.fixture(scope="module")
def ensemble():
    return SimEnsemble(SimPlatform(), paper_arena())


def test_controllers_drive_the_trials_that_try_genomes_gives(ensemble, genomes):
    driven = ensemble.drive(genomes, [START] * 3, 100, {}, 7)
    for k, genome in enumerate(genomes):
        track = trace_genome(
            SimPlatform(), paper_arena(), genome, noise=0.0, noise_key=NoiseKey(7, individual=k)
        )
        assert np.allclose(driven.poses[0, k, :, :2], track.poses[:, :2], atol=1e-5)
        assert np.array_equal(driven.readings[0, k], track.answers[:, :3].astype(np.float32))
        assert set(np.flatnonzero(driven.cells[0, k])) == set(track.cells)
        assert np.array_equal(driven.stalled[0, k], track.stalled)


def test_commands_of_a_controller_replayed_give_its_trial(ensemble, genomes):
    values = {"drive.track": [0.14, 0.16], "range.0.decay": [0.1, 0.2], "drive.delay": [0.0, 0.3]}
    driven = ensemble.drive(genomes, [START] * 3, 60, values, 7)
    for m in range(2):
        one = {name: value[m : m + 1] for name, value in values.items()}
        both = SimEnsemble(
            SimPlatform(), paper_arena(), ranges={n: (min(v), max(v)) for n, v in values.items()}
        )
        replayed = both.replay([START] * 3, driven.commands[m], one, 7, same_noise=True)
        if m == 0:  # robots after the first draw other random numbers
            assert np.array_equal(replayed.poses[0], driven.poses[0])
            assert np.array_equal(replayed.wheels[0], driven.wheels[0])
    assert not np.array_equal(driven.poses[0], driven.poses[1])


def test_the_number_of_threads_changes_no_result_of_an_ensemble(genomes, monkeypatch):
    values = {"drive.gain_left": np.random.default_rng(0).uniform(0.4, 1.6, 40)}
    play = Play(np.array([START] * 3), 30, genomes=tuple(genomes))
    one = SimEnsemble(SimPlatform(), paper_arena(), threads=1)
    whole = one.summarize(play, values, 3, lambda r: r.coverage)
    monkeypatch.setattr(module, "CHUNK_BYTES", 100_000)
    parted = SimEnsemble(SimPlatform(), paper_arena(), threads=3).summarize(
        play, values, 3, lambda r: r.coverage
    )
    assert whole.shape == (40, 3)
    assert np.array_equal(whole, parted)


def test_a_robot_put_back_is_predicted_from_there(ensemble):
    commands = np.tile([[1.0, 0.0]], (1, 6, 1))
    free = ensemble.replay([START], commands, {}, 1).poses[0, 0]
    anchors = np.full((1, 7, 3), np.nan)
    anchors[0, 3] = [0.5, 0.3, np.pi / 2]
    moved = ensemble.replay([START], commands, {}, 1, anchors=anchors).poses[0, 0]
    assert np.array_equal(moved[:4], free[:4])
    turn = np.pi / 2 - free[3, 2]
    step = free[4] - free[3]
    ahead = [step[0] * np.cos(turn) - step[1] * np.sin(turn), step[0] * np.sin(turn) + step[1] * np.cos(turn)]
    assert moved[4] - [0.5, 0.3, np.pi / 2] == pytest.approx([*ahead, step[2]], abs=1e-5)


def test_values_that_are_not_kept_have_no_steps(ensemble):
    rehearsal = ensemble.replay([START], np.ones((1, 5, 2)), {}, 1, keep=("stalled",))
    assert rehearsal.poses.shape == (1, 1, 0, 3)
    assert rehearsal.stalled.shape == (1, 1, 6)


def test_sets_that_do_not_fit_are_refused(ensemble):
    with pytest.raises(ValueError, match=r"drive.lag has shape \(3,\), expected \(2,\)"):
        ensemble.replay([START], np.ones((1, 5, 2)), {"drive.track": [0.1, 0.2], "drive.lag": [0, 0, 0]}, 1)
    with pytest.raises(ValueError, match=r"drive\.trak"):
        ensemble.replay([START], np.ones((1, 5, 2)), {"drive.trak": [0.1]}, 1)
    with pytest.raises(ValueError, match=r"(greater|more) than 0"):
        ensemble.replay([START], np.ones((1, 5, 2)), {"drive.track": [-0.1]}, 1)
    with pytest.raises(ValueError, match="commands has shape"):
        ensemble.replay([START] * 2, np.ones((1, 5, 2)), {}, 1)


def test_each_robot_does_what_sim_does_with_its_numbers_beside_all_others() -> None:
    """Pressed at a wall, where the parts show into which a step is cut."""
    wide = {f"body.0.corner.{k}.y": y for k, y in enumerate(corner.y for corner in ROBOT.body[0].corner)}
    values = {
        "drive.gain_left": [0.4, 1.0, 1.6, 0.4],
        "drive.delay": [0.0, 0.1, 0.3, 0.0],
        **{name: [y, y, 0.6 * y, 0.8 * y] for name, y in wide.items()},
    }
    starts, commands = np.array([[0.3, 0.3, 0.8]]), np.tile([0.7, 0.3], (1, 30, 1))
    ranges = {"drive.gain_left": (0.2, 2.0), "drive.delay_jitter": (0.0, 0.2)}
    together = SimEnsemble(SimPlatform(noise=False), paper_arena(), ranges=ranges, threads=2).replay(
        starts, commands, values, 0
    )
    for m in range(4):
        own = {name: value[m] for name, value in values.items()}
        alone = SimEnsemble(SimPlatform(noise=False, set=own), paper_arena()).replay(starts, commands, {}, 0)
        assert np.array_equal(together.poses[m], alone.poses[0])
        assert np.array_equal(together.cells[m], alone.cells[0])
    assert together.stalled[1:3].any(axis=(1, 2)).all()


def test_numbers_that_no_set_names_are_the_robots_whatever_ranges_are_given() -> None:
    wide = {"drive.gain_left": (0.5, 1.5), "drive.delay": (0.0, 0.3), "contact.friction": (0.0, 1.0)}
    starts, commands = np.array([[0.5, 0.3, 0.0]]), np.tile([0.5, 0.3], (1, 8, 1))
    plain, ranged = (
        SimEnsemble(SimPlatform(noise=False), paper_arena(), ranges=ranges).replay(
            starts, commands, {"drive.lag": np.array([0.1])}, 0
        )
        for ranges in (None, wide)
    )
    assert np.array_equal(ranged.poses, plain.poses)

"""A design in a ledger: its hash, the order and the codes that follow from it, and whether edits are found."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realitygap.errors import LedgerError, RecordError
from realitygap.records import (
    AMENDED,
    UNBLINDED,
    EndReason,
    Ledger,
    ObservationsHead,
    open_saved_trials,
    read_observations,
    secret_path,
)
from realitygap.records import _locked_design as locked_design
from tests.forks import fork_context
from tests.records.test_observations_file import HEAD, trial

CONTROLLERS: ObservationsHead = replace(HEAD, observe="cells")
GENOMES = ('{"a":1}', '{"b":2}')
DESIGN = {
    **{"command": "try", "exclusion": "none", "unit": "pair", "names": {}, "target": {}, "test": None},
    **{"settings": {"trials": 6}, "others": [], "blocks": 6, "first": 0, "stride": None},
    "arms": [
        {"name": name, "sha256": locked_design.hashlib.sha256(genome.encode()).hexdigest()}
        for name, genome in zip("AB", GENOMES, strict=True)
    ],
}
CHANGE = {"who": "ann", "version": "1", "reason": "more"}
SHA = st.binary(min_size=32, max_size=32).map(bytes.hex)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file with a blind design, an amendment, and one trial."""
    path = tmp_path / "pairs.sqlite"
    with open_saved_trials(path, CONTROLLERS) as ledger:
        ledger.lock_design(DESIGN, who="ann", version="1", is_blind=True)
        ledger.append(of_arm(0))
        more = {**DESIGN, "settings": {"trials": 9}}
        ledger.change_design(
            AMENDED, CHANGE | {"before": {"trials": 6}, "after": {"trials": 9}, "design": more}
        )
    return path


def of_arm(arm: int, number: int = 0) -> object:
    return replace(trial(number), purpose="controller", genome=GENOMES[arm])


def test_hash_of_an_event_is_that_of_its_content_in_every_process():
    content = {"b": [1, 0.1, None, True], "a": {"ü": "é\n"}, "sha256": "is no content"}
    expected = "7d032de6f3a255b09846ffa9400549c68a3d01ed403a5952735c7cfd2532a0d3"
    code = f"from realitygap.records import _locked_design as d; print(d.event_hash({content!r}))"
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert other.strip() == locked_design.event_hash(dict(reversed(content.items()))) == expected


@given(SHA, st.integers(0, 10**6), st.integers(1, 40))
def test_order_of_a_block_is_a_permutation_and_a_function_of_the_hash(sha256, block, n):
    order = locked_design.random_order(sha256, block, n)
    assert sorted(order) == list(range(n))
    assert order == locked_design.random_order(sha256, block, n)


def test_orders_of_two_hashes_differ_and_both_arms_go_first_equally_often():
    """Chance alone gives a share outside 0.45 to 0.55 once in 130,000 hashes; this one is fixed."""
    firsts = [
        [locked_design.random_order(sha * 64, block, 2)[0] for block in range(2000)] for sha in ("0", "1")
    ]
    assert all(0.45 < sum(each) / 2000 < 0.55 for each in firsts)
    assert 0.45 < sum(a == b for a, b in zip(*firsts, strict=True)) / 2000 < 0.55


@given(SHA, st.binary(min_size=1, max_size=64), st.integers(1, 60))
def test_codes_are_distinct_and_depend_on_the_secret(sha256, secret, n):
    codes = locked_design.blind_codes(sha256, secret, n)
    assert len(set(codes)) == n
    assert all(len(code) == 4 and code.isalpha() for code in codes)
    assert codes == locked_design.blind_codes(sha256, secret, n)
    assert codes != locked_design.blind_codes(sha256, secret + b"x", n)  # equal once in 160,000 at n = 1


def test_equal_designs_have_different_hashes_so_nobody_chooses_the_order(tmp_path):
    hashes = set()
    for k in range(3):
        with open_saved_trials(tmp_path / f"{k}.sqlite", CONTROLLERS) as ledger:
            hashes.add(ledger.lock_design(DESIGN, who="ann", version="1").sha256)
    assert len(hashes) == 3


def test_design_is_locked_once_and_before_the_first_trial(path, tmp_path):
    with Ledger.open(path) as ledger, pytest.raises(LedgerError, match="locked design already"):
        ledger.lock_design(DESIGN, who="ann", version="1")
    late = tmp_path / "late.sqlite"
    with open_saved_trials(late, CONTROLLERS) as ledger:
        ledger.append(of_arm(0))
        with pytest.raises(LedgerError, match="before the first one"):
            ledger.lock_design(DESIGN, who="ann", version="1", is_blind=True)
        assert ledger.design() is None
        with pytest.raises(LedgerError, match="no locked design"):
            ledger.change_design(AMENDED, {})


def test_blind_trials_have_codes_in_place_of_controllers_until_they_are_unblinded(path):
    with Ledger.open(path) as ledger:
        design = ledger.design()
        assert (design.is_blind, design.problem, design.design["settings"]) == (True, "", {"trials": 9})
        (shown,) = ledger.trials()
        assert (shown.controller, shown.arm) == (None, locked_design.HIDDEN_CODE)
        ledger.append(replace(of_arm(1, 1), end=EndReason.RUNNING))
        under_way = ledger.trial(2)
        assert (under_way.controller, under_way.arm) == (None, design.codes()[design.arms[1]])
        assert under_way.arm in under_way.name
        with pytest.raises(RecordError, match="blind"):
            read_observations(path)
        ledger.change_design(UNBLINDED, CHANGE | {"complete": 0})
        assert (ledger.trial(1).controller, ledger.trial(1).arm) == (1, "")
    assert len(read_observations(path).trials) == 1


def test_lost_secret_shows_neither_codes_nor_controllers(path):
    with Ledger.open(path, writable=False) as ledger:
        codes = set(ledger.design().codes().values())
    secret_path(path).write_bytes(b"another one")
    with Ledger.open(path, writable=False) as ledger:
        assert ledger.trial(1).controller is None
        assert set(ledger.design().codes().values()) == {locked_design.LOST_CODE}
        assert locked_design.LOST_CODE not in codes


@pytest.mark.parametrize("event", [0, 1])
def test_edited_events_are_found(path, event):
    with contextlib.closing(sqlite3.connect(path)) as connection:
        rows = connection.execute("SELECT id, details FROM events WHERE what LIKE 'design %'").fetchall()
        number, text = rows[event]
        for name in json.loads(text):
            if name == "previous":
                continue  # below: the hash is computed again
            details = json.loads(text)
            details[name] = {"design": {**DESIGN, "blocks": 7}, "before": {}, "after": {}}.get(
                name, "another"
            )
            connection.execute("UPDATE events SET details = ? WHERE id = ?", (json.dumps(details), number))
            connection.commit()
            with Ledger.open(path) as ledger:
                assert "was edited" in ledger.design().problem, name
                with pytest.raises(LedgerError, match="was edited"):
                    ledger.change_design(AMENDED, {"reason": "hides it"})


def test_replaced_event_with_its_own_hash_breaks_the_chain(path):
    with contextlib.closing(sqlite3.connect(path)) as connection:
        number, text = connection.execute(
            "SELECT id, details FROM events WHERE what = 'design locked'"
        ).fetchone()
        details = json.loads(text) | {"who": "another"}
        details["sha256"] = locked_design.event_hash(details)
        connection.execute("UPDATE events SET details = ? WHERE id = ?", (json.dumps(details), number))
        connection.commit()
    with Ledger.open(path, writable=False) as ledger:
        assert "does not follow" in ledger.design().problem


def test_damaged_events_are_one_error(path):
    with contextlib.closing(sqlite3.connect(path)) as connection:
        for text in ("{}", '{"design":1}', '{"design":{"arms":[1]}}', '{"design":{"arms":[{"sha256":"x"}]}}'):
            connection.execute("UPDATE events SET details = ? WHERE what = 'design locked'", (text,))
            connection.commit()
            with Ledger.open(path, writable=False) as ledger, pytest.raises(LedgerError, match="damaged"):
                ledger.design()


def test_design_without_its_lock_is_damaged(path):
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.execute("UPDATE events SET what = 'another' WHERE what = 'design locked'")
        connection.commit()
    with Ledger.open(path, writable=False) as ledger, pytest.raises(LedgerError, match="before it"):
        ledger.design()


def lock_and_die(path: str, point: str) -> None:
    """Lock a blind design, and end as a power cut does at a point."""

    def die(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    with open_saved_trials(path, CONTROLLERS) as ledger:
        if point == "before the event":
            ledger._note_design = die  # type: ignore[method-assign]
        elif point == "before the commit":
            ledger._commit = die  # type: ignore[method-assign]
        ledger.lock_design(DESIGN, who="ann", version="1", is_blind=True)
        die()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="kills processes")
@pytest.mark.parametrize("point", ["before the event", "before the commit", "after it"])
def test_lock_survives_a_kill_at_any_moment(tmp_path, point):
    path = tmp_path / "pairs.sqlite"
    process = fork_context().Process(target=lock_and_die, args=(str(path), point))
    process.start()
    process.join(60)
    assert process.exitcode == -signal.SIGKILL
    with open_saved_trials(path, CONTROLLERS) as ledger:
        design = ledger.design()
        assert (design is not None) == (point == "after it")
        if design is None:
            design = ledger.lock_design(DESIGN, who="ann", version="1", is_blind=True)
        assert design.secret is not None
        assert design.problem == ""
        assert len(set(design.codes().values())) == 2

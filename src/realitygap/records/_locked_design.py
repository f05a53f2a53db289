"""A design that is locked in a ledger before trial 1: its hash, its random order, its blind codes, and later changes.

Each event of a design has the SHA-256 of its own content and of the event before it, so an edited one is found. The
order and the codes are functions of the hash of the first event, which has a random number: nobody can choose them.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from realitygap._limits import parse_json

LOCKED: Final = "design locked"
RESUMED: Final = "design resumed"
AMENDED: Final = "design amended"
UNBLINDED: Final = "design unblinded"
DESIGN_EVENTS = (LOCKED, RESUMED, AMENDED, UNBLINDED)
"""Events of a design. A session with another program or robot than before is `RESUMED`."""

_CHANGE: Final = {"who": str, "version": str, "reason": str}
_FORMS: Mapping[str, Mapping[str, Any]] = {
    LOCKED: {"who": str, "version": str, "time": str},
    RESUMED: {"version": str, "target": Mapping},
    AMENDED: _CHANGE | {"before": Mapping, "after": Mapping},
    UNBLINDED: _CHANGE | {"complete": int},
}
_DESIGN_FORMS: Mapping[str, Any] = {
    **{
        "command": str,
        "exclusion": str,
        "unit": str,
        "settings": Mapping,
        "names": Mapping,
        "target": Mapping,
    },
    **{
        "arms": list,
        "others": list,
        "blocks": int,
        "first": int,
        "stride": int | None,
        "test": Mapping | None,
    },
}
"""What each event, and each design, has to have."""

HIDDEN_CODE = "blind"
"""In place of the code of an arm where its cells are shown."""

LOST_CODE = "???"
"""Code of every arm if the file with the secret is missing or is another one."""

_LETTERS = "BCDFGHJKLMNPQRSTVWXZ"
"""Letters of codes, without vowels, so that none is a word."""

_SECRET_BYTES = 32

_MOST_TRIALS = 5_000_000
"""Most trials of a design, whose order is computed: a gap has up to 1,024 controllers with 4,096 trials each."""

_MOST_LETTERS = 2_000_000
"""Longest event of a design: one of a thousand arms has about 150,000 letters."""


def canonical_json(value: Any) -> str:
    """Return JSON with sorted keys and without spaces: equal values give equal text on every machine.

    Raises:
        ValueError: A number is infinite or NaN.
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)


def event_hash(details: Mapping[str, Any]) -> str:
    """Return the SHA-256 of an event's content, without the hash that it has."""
    content = {name: value for name, value in details.items() if name != "sha256"}
    return hashlib.sha256(canonical_json(content).encode()).hexdigest()


def random_order(sha256: str, block: int, n: int) -> tuple[int, ...]:
    """Return the order of n arms in a block, a function of the hash alone. All orders are equally likely.

    Arms are sorted by the SHA-256 of hash, block, and arm, so that the order depends on no library's generator.
    """
    keys = [hashlib.sha256(f"{sha256}:{block}:{arm}".encode()).digest() for arm in range(n)]
    return tuple(sorted(range(n), key=keys.__getitem__))


def blind_codes(sha256: str, secret: bytes, n: int) -> tuple[str, ...]:
    """Return a code of four letters for each of n arms, from the hash and a secret (HMAC-SHA-256)."""
    codes: list[str] = []
    attempt = 0
    while len(codes) < n:
        digest = hmac.new(secret, f"{sha256}:{attempt}".encode(), hashlib.sha256).digest()
        number = int.from_bytes(digest, "big")
        code = "".join(_LETTERS[number // len(_LETTERS) ** k % len(_LETTERS)] for k in range(4))
        attempt += 1
        if code not in codes:
            codes.append(code)
    return tuple(codes)


def secret_path(ledger: Path) -> Path:
    """Return the path of the file with the secret of a ledger's codes."""
    return ledger.with_name(f"{ledger.name}.secret")


def new_secret() -> bytes:
    """Return a secret, drawn by the operating system."""
    return secrets.token_hex(_SECRET_BYTES).encode()


def lock_details(
    design: Mapping[str, Any], who: str, version: str, time: str, secret: bytes | None
) -> dict[str, Any]:
    """Return the content of the event that locks a design, blind if there is a secret."""
    return {
        "design": parse_json(canonical_json(design)),
        "who": who,
        "version": version,
        "time": time,
        "random": secrets.token_hex(_SECRET_BYTES),
        "secret_sha256": None if secret is None else hashlib.sha256(secret).hexdigest(),
    }


@dataclass(frozen=True)
class DesignEvent:
    """An event of a locked design.

    Attributes:
        what: One of `DESIGN_EVENTS`.
        details: Its content.
        n_trials: Number of trials that had begun before it.
    """

    what: str
    details: Mapping[str, Any]
    n_trials: int


@dataclass(frozen=True)
class LockedDesign:
    """A design as a ledger has it.

    Attributes:
        events: Its events, oldest first. The first one locked it.
        secret: Secret of the codes; None if it is missing, or if the design is not blind.
        problem: What shows that the events were edited; empty if nothing does.
    """

    events: tuple[DesignEvent, ...]
    secret: bytes | None = None
    problem: str = ""

    @property
    def lock(self) -> Mapping[str, Any]:
        """Content of the event that locked it."""
        return self.events[0].details

    @property
    def sha256(self) -> str:
        """Hash of the event that locked it."""
        return str(self.lock.get("sha256", ""))

    @property
    def design(self) -> Mapping[str, Any]:
        """The design with all amendments."""
        changed = [each.details["design"] for each in self.of(AMENDED) if "design" in each.details]
        design: Mapping[str, Any] = (changed or [self.lock["design"]])[-1]
        return design

    @property
    def arms(self) -> tuple[str, ...]:
        """SHA-256 of the controller of each arm."""
        return tuple(str(arm["sha256"]) for arm in self.design.get("arms", ()))

    @property
    def was_blind(self) -> bool:
        """True if it was locked blind."""
        return self.lock.get("secret_sha256") is not None

    @property
    def is_blind(self) -> bool:
        """True if results of its arms are not shown yet."""
        return self.was_blind and not self.of(UNBLINDED)

    def of(self, what: str) -> list[DesignEvent]:
        """Return the events of a kind."""
        return [event for event in self.events if event.what == what]

    def order(self, block: int) -> tuple[int, ...]:
        """Return the arms of a block in their order."""
        return random_order(self.sha256, block, len(self.arms))

    def codes(self) -> dict[str, str]:
        """Return the code of each arm by the SHA-256 of its controller."""
        if self.secret is None:
            return dict.fromkeys(self.arms, LOST_CODE)
        return dict(zip(self.arms, blind_codes(self.sha256, self.secret, len(self.arms)), strict=True))


def read_design(events: Sequence[DesignEvent], ledger: Path) -> LockedDesign | None:
    """Return the design that the events of a ledger have; None if there is none.

    Args:
        events: Events of kinds in `DESIGN_EVENTS`, oldest first.
        ledger: Path of the ledger, next to which its secret is.
    """
    if not events:
        return None
    if events[0].what != LOCKED:
        raise ValueError(f"{events[0].what!r} has no {LOCKED!r} before it")
    for event in events:
        _check(event)
    problem, previous = "", ""
    for k, event in enumerate(events):
        details = event.details
        is_first = event.what == LOCKED
        if details.get("sha256") != event_hash(details):
            problem = f"event {k + 1} of the design, {event.what!r}, was edited: its hash does not fit"
        elif is_first != (k == 0) or details.get("previous", "") != previous:
            problem = f"event {k + 1} of the design, {event.what!r}, does not follow the one before it"
        elif is_first and event.n_trials:
            problem = "the design was locked after the first trial"
        if problem:
            break
        previous = str(details["sha256"])
    return LockedDesign(tuple(events), _secret(events[0].details, ledger), problem)


def _check(event: DesignEvent) -> None:
    """Raise a ValueError unless an event has the form of its kind."""
    details = event.details
    forms = dict(_FORMS[event.what])
    if len(canonical_json(details)) > _MOST_LETTERS:
        raise ValueError(f"{event.what!r} is too long")
    if event.what == LOCKED or "design" in details:
        forms["design"] = Mapping
    _check_forms(event.what, details, forms)
    if "design" not in forms:
        return
    design = details["design"]
    _check_forms(event.what, design, _DESIGN_FORMS)
    for arm in design["arms"]:
        if not isinstance(arm, Mapping):
            raise ValueError(f"{event.what!r} has an arm that cannot be read")
        _check_forms(event.what, arm, {"name": str, "sha256": str})
    if not 0 <= design["blocks"] * max(len(design["arms"]), 1) <= _MOST_TRIALS:
        raise ValueError(f"{event.what!r} has too many trials")


def _check_forms(what: str, values: Mapping[str, Any], forms: Mapping[str, Any]) -> None:
    for name, form in forms.items():
        if not isinstance(values.get(name), form):
            raise ValueError(f"{what!r} has no {name} that can be read")


def _secret(lock: Mapping[str, Any], ledger: Path) -> bytes | None:
    """Return the secret next to a ledger, if it is the one with which its design was locked."""
    wanted = lock.get("secret_sha256")
    try:
        secret = secret_path(ledger).read_bytes()[: 4 * _SECRET_BYTES] if wanted else b""
    except OSError:
        return None
    return secret if hashlib.sha256(secret).hexdigest() == wanted else None

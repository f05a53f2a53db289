"""Fits use one thread for linear algebra, so their digits do not depend on the number of processors."""

from __future__ import annotations

import inspect
from typing import Any, NoReturn

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from realitygap import calibration

FITS = sorted(name for name in calibration.__all__ if name.startswith("fit_"))


class UsedError(Exception):
    """An argument was used."""


class Spy:
    """Any argument; raises the largest number of threads of linear algebra when it is used."""

    def _raise(self, *_: Any) -> NoReturn:
        raise UsedError(
            max(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")
        )

    __array__ = __bool__ = __getattr__ = __getitem__ = __iter__ = __len__ = _raise


@pytest.mark.parametrize("name", [*FITS, "choose_frame", "information_of", "next_trials"])
def test_linear_algebra_of_a_fit_has_one_thread(name: str) -> None:
    fit = getattr(calibration, name)
    needed = [p for p in inspect.signature(fit).parameters.values() if p.default is p.empty]
    given = {p.name: Spy() for p in needed if p.kind is p.KEYWORD_ONLY}
    with threadpool_limits(limits=2, user_api="blas"):
        with pytest.raises(UsedError) as used:
            fit(*[Spy() for p in needed if p.kind is not p.KEYWORD_ONLY], **given)
        assert used.value.args == (1,)
        assert max(library["num_threads"] for library in threadpool_info()) >= 2

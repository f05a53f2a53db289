"""One thread for the linear algebra of a fit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit the linear algebra of NumPy and SciPy to one thread; also a decorator.

    OpenBLAS adds in another order for each number of threads, and optimizers enlarge the differences, so the digits of
    a fit would depend on the machine's processors. The matrices of fits are too small for threads to pay.
    """
    import scipy.linalg  # noqa: F401  # loads SciPy's own library, which has to be there to be limited

    with threadpool_limits(limits=1, user_api="blas"):
        yield

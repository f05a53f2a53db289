"""A base for classes that a `with` block closes."""

from __future__ import annotations

from typing import Self


class ClosedOnExit:
    """Something with a method `close`, which a `with` block calls at its end."""

    def close(self) -> None:
        """Let go of what is held; safe to call twice."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

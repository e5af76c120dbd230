"""Signals that ask a run to stop: the first lets it finish its current step, the second aborts it."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self, final

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@final
class Stopping:
    """A context that turns SIGINT (Ctrl-C) and SIGTERM into a request to stop; true once a signal has come.

    Outside Python's main thread it catches no signals. Contexts can be nested, such as that of a run inside that of a
    study: a signal caught by the inner one is a request to the outer one too.

    Attributes:
        asked_by: name of the signal that asked to stop, empty if none has come.
    """

    def __init__(self) -> None:
        self.asked_by = ""
        self._before: dict[signal.Signals, Any] = {}

    def __bool__(self) -> bool:
        return bool(self.asked_by)

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            # A process that was started to ignore SIGINT, such as a background job of a shell, goes on ignoring it.
            heard = [number for number in _SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
            self._before = {number: signal.signal(number, self._asked) for number in heard}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._give_back()

    def _asked(self, number: int, frame: FrameType | None) -> None:
        """Note the first signal; from the second on, signals are handled as they were before this context."""
        if not self:
            self.asked_by = signal.Signals(number).name
            around = getattr(self._before.get(signal.Signals(number)), "__self__", None)
            if isinstance(around, Stopping):
                around.asked_by = around.asked_by or self.asked_by
            return
        self._give_back()
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        signal.raise_signal(number)

    def _give_back(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        self._before = {}

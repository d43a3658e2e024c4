"""One thread at a time uses Taichi: it has one state for all threads, and ends the process where two change it."""

import functools
import threading
from collections.abc import Callable
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable)
LOCK = threading.RLock()


def one_at_a_time(function: Function) -> Function:
    """The function, which waits until no other thread is in one that is decorated like this."""

    @functools.wraps(function)
    def called(*arguments: Any, **named: Any) -> Any:
        with LOCK:
            return function(*arguments, **named)

    return called  # type: ignore[return-value]

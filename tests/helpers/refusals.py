"""Errors for the user: one line."""

from collections.abc import Callable

import pytest


def refused(error: type[Exception], message: str, call: Callable[..., object], /, *args: object, **more: object):
    """The error with which a call refuses its arguments: one line, in which the message, a pattern, is found."""
    with pytest.raises(error, match=message) as caught:
        call(*args, **more)
    assert "\n" not in str(caught.value)
    return caught.value

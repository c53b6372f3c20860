"""The texts that users meet: those of the sources are the reviewed ones."""

import difflib

import pytest
from messages import SNAPSHOT, messages, snapshot


def test_every_message_is_the_reviewed_one():
    kept, now = (text.splitlines() for text in (SNAPSHOT.read_text(encoding="utf-8"), snapshot()))
    changes = [line for line in difflib.unified_diff(kept, now, "tests/messages.txt", "sources", n=0, lineterm="")]
    assert not changes, "read the changes as a stranger would, then run `make messages`:\n" + "\n".join(changes[:60])


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ('raise ValueError(f"q{j} is {value}")', []),
        (
            'raise ValueError(f"{name}: q{j} never changes by {step:.3g} rad")',
            ["{...}: q{...} never changes by {...} rad"],
        ),
        (
            'x = "one " "text of two" + f" and {a if b else \'four more words here\'}"',
            ["one text of two", "four more words here"],
        ),
        ('def f(x: "Callable of three words") -> "an annotation as well":\n    """A docstring of words."""', []),
        ('assert x, "only a sign is"\npattern = re.compile("three words here")', []),
        ('HELP = "a text of words"\n"""What it is about."""', ["a text of words"]),
        ('print("said twice by us"); print("said twice by us")', ["said twice by us"]),
    ],
)
def test_messages_are_the_literals_that_a_user_can_read(source, expected):
    assert list(messages(source)) == expected

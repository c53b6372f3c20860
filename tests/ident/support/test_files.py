import time

import pytest
from refusals import refused

from ident.support import files
from ident.support.errors import PayloadError, placed
from ident.support.files import DEEPEST, LARGEST, read_toml
from ident.support.naming import nearest, one_line, shown


def read(path, content: str | bytes) -> dict[str, object]:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_toml(path, error=PayloadError)


def nested(depth: int) -> dict[str, str]:
    """Values that are `depth` levels deep, the file itself the first."""
    inner = depth - 1
    return {
        "arrays": "a = " + "[" * inner + "]" * inner,
        "tables": "a = " + "{a = " * inner + "1" + "}" * inner,
        "dotted": ".".join("a" * inner) + ".b = 1",
        "dotted with spaces": " . ".join("a" * inner) + ".b = 1",
        "headed": "[" + ".".join("a" * inner) + "]",
        "dotted in a table": "a = {" + ".".join("a" * inner) + " = 1}",
    }


@pytest.mark.parametrize("kind", nested(3))
def test_nesting_is_read_up_to_its_limit_and_deeper_ends_at_once(tmp_path, kind):
    read(tmp_path / "a.toml", nested(DEEPEST)[kind])
    started = time.process_time()
    for depth in (DEEPEST + 1, 100_000):
        with pytest.raises(PayloadError, match=rf"a\.toml: .* nested deeper than {DEEPEST}"):
            read(tmp_path / "a.toml", nested(depth)[kind])
    assert time.process_time() - started < 5.0  # tomllib's own way takes minutes; this takes 0.1 s


def test_a_file_is_read_up_to_its_largest_size_with_a_mark_and_rows_of_many_numbers(tmp_path):
    path, row = tmp_path / "a.toml", "[" + ", ".join(["-0.125"] * 40) + "]"
    assert read(path, f"x = [\n    {row},\n    {row},\n]\n") == {"x": [[-0.125] * 40] * 2}  # no deep keys
    assert read(path, b"\xef\xbb\xbfx = 3") == {"x": 3}
    read(path, "#" + "x" * (LARGEST - 1))
    for content, message in (
        ("#" + "x" * LARGEST, "4 MB are too much; such files are read up to 4 MB"),
        ("x = 0,25", r"not TOML: .*; numbers have a decimal point$"),
        (b"x = '\xe9'", "byte 5 is not UTF-8"),
        ("", "the file is empty"),
    ):
        refused(PayloadError, message, read, path, content)


def test_what_may_not_or_cannot_be_read_is_named(tmp_path, monkeypatch):
    for path, message in (
        (files.Path("a\0.toml"), "embedded null (byte|character)"),
        (tmp_path, "is a folder; expected a regular file"),
        (files.Path("/dev/null"), "is a device; expected a regular file"),
        (tmp_path / "b.toml", r"b\.toml: no such file"),
    ):
        refused(PayloadError, message, read_toml, path, error=PayloadError)
    (tmp_path / "a.toml").write_text("x = 1")

    def denied(_: object) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.Path, "read_bytes", denied)  # whoever runs the tests may be allowed everything
    refused(PayloadError, r"a\.toml: Permission denied", read_toml, tmp_path / "a.toml", error=PayloadError)


def test_a_message_begins_with_each_of_its_places_once():
    def within(outer: str, inner: str, reason: str) -> None:
        with placed(outer), placed(inner):
            raise PayloadError(reason)

    for places, message in (
        (("a/b.toml", "payload"), "a/b.toml: payload: t"),
        (("a", "a/b.toml"), "a/b.toml: t"),
        (("a", "a"), "a: t"),
        (("x", "t"), "x: t: t"),
    ):
        with pytest.raises(PayloadError, match=f"^{message} advances$") as caught:
            within(*places, "t advances")
        assert caught.value.reason == "t advances"


def test_values_are_shown_short_and_on_one_line_and_the_nearest_name_is_asked_for():
    assert shown("a\nb") == r"'a\nb'"
    assert shown(2**128 - 1) == str(2**128 - 1)
    assert shown(16**5000) == "a whole number of 20001 bits"
    assert max(len(shown("x" * 10_000)), len(shown(list(range(10_000))))) <= 60
    assert one_line(" a\tb\r\n\x1bc ") == "a b   c"
    assert nearest("mas", ["com", "mass"]) == "; did you mean 'mass'?"
    assert nearest("xyzzy", ["com", "mass"]) == ""

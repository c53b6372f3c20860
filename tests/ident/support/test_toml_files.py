import time

import pytest

from ident.support import files
from ident.support.errors import PayloadError
from ident.support.files import DEEPEST, LARGEST, read_toml
from ident.support.naming import nearest, one_line, shown


def read(path, content: str) -> dict[str, object]:
    path.write_text(content)
    return read_toml(path, error=PayloadError)


def test_rows_of_many_numbers_are_no_deep_keys(tmp_path):
    row = "[" + ", ".join(["-0.125"] * 40) + "]"
    assert read(tmp_path / "a.toml", f"x = [\n    {row},\n    {row},\n]\n") == {"x": [[-0.125] * 40] * 2}


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
def test_nesting_is_read_up_to_its_limit(tmp_path, kind):
    read(tmp_path / "a.toml", nested(DEEPEST)[kind])
    with pytest.raises(PayloadError, match=rf"a\.toml: .* nested deeper than {DEEPEST}"):
        read(tmp_path / "a.toml", nested(DEEPEST + 1)[kind])


@pytest.mark.parametrize("kind", nested(3))
def test_a_hundred_thousand_levels_end_at_once(tmp_path, kind):
    started = time.process_time()
    with pytest.raises(PayloadError, match="nested deeper than"):
        read(tmp_path / "a.toml", nested(100_000)[kind])
    assert time.process_time() - started < 5.0  # tomllib's own way takes minutes; this takes 0.1 s


def test_a_file_is_read_up_to_its_largest_size(tmp_path):
    read(tmp_path / "a.toml", "#" + "x" * (LARGEST - 1))
    with pytest.raises(PayloadError, match="4 MB are too much; such files are read up to 4 MB"):
        read(tmp_path / "a.toml", "#" + "x" * LARGEST)


def test_a_file_that_may_not_be_read_is_named(tmp_path, monkeypatch):
    (tmp_path / "a.toml").write_text("x = 1")

    def denied(_: object) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.Path, "read_bytes", denied)  # whoever runs the tests may be allowed everything
    with pytest.raises(PayloadError, match=r"a\.toml: Permission denied"):
        read_toml(tmp_path / "a.toml", error=PayloadError)


def test_a_name_that_no_file_can_have_is_named():
    with pytest.raises(PayloadError, match="embedded null byte"):
        read_toml(files.Path("a\0.toml"), error=PayloadError)


def test_a_mark_at_the_beginning_does_not_matter(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\xef\xbb\xbfx = 3")
    assert read_toml(tmp_path / "a.toml", error=PayloadError) == {"x": 3}


def test_values_are_shown_short_and_on_one_line():
    assert shown("a\nb") == r"'a\nb'"
    assert shown(2**128 - 1) == str(2**128 - 1)
    assert shown(16**5000) == "a whole number of 20001 bits"
    assert len(shown("x" * 10_000)) <= 60
    assert len(shown(list(range(10_000)))) <= 60
    assert one_line(" a\tb\r\n\x1bc ") == "a b   c"


def test_the_nearest_name_is_asked_for_and_none_if_none_is_near():
    assert nearest("mas", ["com", "mass"]) == "; did you mean 'mass'?"
    assert nearest("xyzzy", ["com", "mass"]) == ""

"""Edits of a model's text in place: all other bytes stay."""

import pytest

from scenarios.gains_in_use.model_update.edits import model_text
from scenarios.support.errors import ScenarioError


def test_an_attribute_within_the_value_of_another_is_not_taken_for_it(tmp_path):
    content = b"""\xef\xbb\xbf<?xml version="1.0"?><!-- <a x="0"/> --><a y=" x='1'" x = "2"><b/></a>"""
    (tmp_path / "a.xml").write_bytes(content)
    file = model_text(tmp_path / "a.xml")
    assert file.edited([file.attribute(file.root, "x", "3")]) == content.replace(b'"2"', b'"3"')
    two = [file.attribute(file.root.children[0], name, "4") for name in ("p", "q")]
    assert file.edited(two) == content.replace(b"<b/>", b'<b p="4" q="4"/>')


def test_a_file_with_a_comment_in_latin_1_keeps_its_bytes(tmp_path):
    content = "<!-- Jos\u00e9 --><a><b x='1'/></a>".encode("latin-1")
    (tmp_path / "a.xml").write_bytes(content)
    file = model_text(tmp_path / "a.xml")
    assert file.edited([file.attribute(file.root.children[0], "x", "2")]) == content.replace(b"'1'", b"'2'")


def test_text_that_is_not_bytes_of_its_characters_is_refused(tmp_path):
    (tmp_path / "here").write_bytes('<?xml version="1.0" encoding="UTF-16"?><a/>'.encode("utf-16"))
    file = model_text(tmp_path / "here")
    with pytest.raises(ScenarioError, match="here: a: the text cannot be edited in place; save the file as UTF-8"):
        file.attribute(file.root, "x", "1")

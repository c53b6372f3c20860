"""What `make latest` says of packages and of tests that fail."""

from importlib.metadata import version

from bench.latest import failures, newer


def test_packages_of_another_version_are_told_with_both():
    lock = f"numpy==0.7.3 \\\n    --hash=sha256:ab\nscipy=={version('scipy')} ; python_version > '3'\nno-such==1.0\n"
    assert newer(lock) == {"numpy": ("0.7.3", version("numpy"))}


def test_tests_that_fail_are_named_with_the_first_line_of_why(tmp_path):
    cases = (
        '<testcase classname="a.b" name="one"/><testcase classname="a.b" name="two"><failure message="gone&#10;more"/>'
        '</testcase><testcase classname="c" name="three"><error message="no module"/></testcase>'
    )
    (tmp_path / "report.xml").write_text(f"<testsuites><testsuite>{cases}</testsuite></testsuites>")
    assert failures(tmp_path / "report.xml") == ["a.b.two: gone", "c.three: no module"]

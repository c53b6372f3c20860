"""The notebook as a page: what marimo makes of it, what its cells show, and the picture that it draws."""

import re
import runpy
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import marimo
from matplotlib.figure import Figure

HEAD = """# A case from Python

From a scenario to a gain and back, cell by cell. This page is the notebook `examples/case.py`; a test runs it.

"""
DRAWN = "![Currents of both motions, joint by joint](../case.png)"


def notebook_page(notebook: Path) -> str:
    """The notebook's words and cells, each with what it shows."""
    outputs, _ = runpy.run_path(str(notebook))["app"].run()
    shown = iter([each for each in outputs if not isinstance(each, marimo.Html)])  # of code, not of words
    with TemporaryDirectory() as folder:
        page = Path(folder) / "page.md"
        command = [sys.executable, "-m", "marimo", "--quiet", "export", "md", str(notebook), "--output", str(page)]
        subprocess.run(command, capture_output=True, check=True)
        text = page.read_text(encoding="utf-8")
    text = re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.DOTALL)

    def with_output(cell: re.Match[str]) -> str:
        output = _output(next(shown))
        return "" if cell[1] else f"```python\n{cell[2]}```\n{output}"

    text = re.sub(r"^```python \{\.marimo( hide_code[^}]*)?\}\n(.*?)^```$\n?", with_output, text, flags=re.M | re.S)
    return HEAD + text.strip() + "\n"


def _output(value: object) -> str:
    """What a notebook shows below a cell: nothing, a picture, a table, or text."""
    if value is None:
        return ""
    if isinstance(value, Figure):
        return f"\n{DRAWN}\n"
    table = getattr(value, "_repr_html_", None)
    if table is None:
        return f"\n```text\n{value!r}\n```\n"
    shown = table().replace(' border="1" class="dataframe"', "")  # of pandas: the site's own style
    return f'\n<div class="output">{shown}</div>\n'

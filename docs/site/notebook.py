"""The notebook as a page: what marimo makes of it, and the picture that it draws."""

import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

HEAD = """# A case from Python

From a scenario to a gain and back, cell by cell. This page is the notebook `examples/case.py`; a test runs it.

"""
DRAWN = "![Currents of both motions, joint by joint](../case.png)"


def notebook_page(notebook: Path) -> str:
    """The notebook's words and cells, its picture behind the cell that shows it."""
    with TemporaryDirectory() as folder:
        page = Path(folder) / "page.md"
        command = [sys.executable, "-m", "marimo", "--quiet", "export", "md", str(notebook), "--output", str(page)]
        subprocess.run(command, capture_output=True, check=True)
        text = page.read_text(encoding="utf-8")
    text = re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.DOTALL)
    text = re.sub(r'^```python \{\.marimo hide_code="true"\}\n.*?^```\n', "", text, flags=re.MULTILINE | re.DOTALL)
    text = text.replace("```python {.marimo}", "```python")
    return HEAD + text.replace("\nfigure\n```\n", f"\nfigure\n```\n\n{DRAWN}\n").strip() + "\n"

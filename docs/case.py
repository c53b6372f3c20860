"""Draws case.png: the picture of the notebook `examples/case.py`."""

import sys
from pathlib import Path

HOME = Path(__file__).parent
sys.path.insert(0, str(HOME.parent / "examples"))
from case import app  # noqa: E402

_, made = app.run()
made["figure"].savefig(HOME / "case.png", dpi=110)

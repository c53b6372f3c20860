"""Declarative experiments: scenario files, verdicts, studies, reports, and the command line `rx90`.

Public names are exported here, listed in `__init__.pyi`, and imported at first use: simulator and identification take
over a second.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

"""Declarative experiments: scenario files, the verdict on them, studies, reports, and the command line `rx90`.

What a user needs is exported here, named in `__init__.pyi`, and read when it is first used: simulator and
identification take over a second.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

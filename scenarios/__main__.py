"""`python -m scenarios` is `rx90`."""

import sys

from scenarios.cli import main

sys.exit(main())

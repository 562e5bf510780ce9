"""``python -m agents.failures``."""

import sys

from agents.failures.report import main

sys.exit(main())

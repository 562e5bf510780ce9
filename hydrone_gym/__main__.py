"""`python -m hydrone_gym` is `hydrone`."""

import sys

from hydrone_gym.cli import main

sys.exit(main())

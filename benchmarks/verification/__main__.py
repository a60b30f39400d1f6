"""`python benchmarks/verification`: the folder's parent holds the package."""

import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).resolve().parents[1])

from verification.page import main  # noqa: E402

main()

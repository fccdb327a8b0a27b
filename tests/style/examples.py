# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the Python examples of the documentation for a type checker, the examples of each page as one file.

python3 tests/style/examples.py FOLDER
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# The examples begin with a mesh.
GIVEN = """import numpy as np
from numpy.typing import NDArray

vertices: NDArray[np.float32]
triangles: NDArray[np.int32]
"""

folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]:
    if blocks := re.findall(r"^```python\n(.*?)^```", page.read_text(), re.M | re.S):
        (folder / f"{page.stem}.py").write_text("\n".join([GIVEN, *blocks]))

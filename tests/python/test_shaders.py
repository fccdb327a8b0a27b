# SPDX-License-Identifier: GPL-3.0-or-later
"""The text of the shaders, where compilers differ: no test on one machine shows what the driver of another refuses."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = [*sorted((ROOT / "shaders").iterdir()), ROOT / "addon/overlay/shaders.py"]
# Functions that GLSL offers for float and for double. With an integer among the arguments NVIDIA's compiler calls some of
# them ambiguous, while Mesa's takes the one for float.
OVERLOADED = re.compile(r"\b(clamp|max|min|mix|mod|pow|smoothstep|step)\(")


def arguments(text, begin):
    """Returns the arguments of the call whose opening parenthesis is before `begin`."""
    found, depth, start = [], 0, begin
    for i in range(begin, len(text)):
        if text[i] in "([":
            depth += 1
        elif text[i] in ")]":
            depth -= 1
        if depth < 0 or (depth == 0 and text[i] == ","):
            found.append(text[start:i].strip())
            start = i + 1
        if depth < 0:
            return found
    raise ValueError(f"a call without an end: {text[begin - 10 : begin + 50]!r}")


def test_arguments():
    text = "mix(0.5, 1, abs(dot(a, b)))"
    assert arguments(text, text.index("(") + 1) == ["0.5", "1", "abs(dot(a, b))"]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_no_overloaded_function_gets_an_integer_constant(file):
    text = re.sub(r"//.*", "", file.read_text(encoding="utf-8"))
    for call in OVERLOADED.finditer(text):
        given = arguments(text, call.end())
        assert not any(re.fullmatch(r"-?\d+", word) for word in given), f"{call[0]}{', '.join(given)})"

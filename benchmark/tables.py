# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes tables into Markdown files. Each table stands between two comment lines with its name."""

from pathlib import Path


def table(heads, rows, align):
    """Returns a table as Markdown. `align` has a letter, l or r, for each column."""
    lines = [heads, ["---:" if letter == "r" else "---" for letter in align], *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def write(path, name, text):
    """Puts `text` between the comment lines of `name`. A file without these lines gets them at its end."""
    begin, end = f"<!-- {name}: written by a script, begin -->", f"<!-- {name}: end -->"
    path = Path(path)
    page = path.read_text() if path.exists() else ""
    before, found, rest = page.partition(begin)
    if found:
        _, found, after = rest.partition(end)
    if not found:
        before, after = page + ("\n" if page else ""), "\n"
    path.write_text(f"{before}{begin}\n{text}\n{end}{after}")


def publish(path, name, text):
    """Prints `text`, and puts it into the file at `path` unless that is None."""
    print(text)
    if path:
        write(path, name, text)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Parses the arguments of all commands, and refuses those that make no sense."""

import argparse
import math
import os
import re
from pathlib import Path

NOT_WRITTEN, USAGE, NOT_PROVED = 1, 2, 3

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf|infinity)"


class Stop(Exception):
    """Ends the command with its message on stderr and an exit code."""

    def __init__(self, message, code=USAGE):
        super().__init__(message)
        self.code = code


class Parser(argparse.ArgumentParser):
    """An ArgumentParser whose errors are one line that names the faulty argument."""

    def __init__(self, **options):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, **options)

    def error(self, message):
        raise Stop(f"{message}; see --help")

    def joined(self, words):
        """Returns the words with each value joined to its option by "=".

        argparse would take a value such as "-1%" for an option.
        """
        valued = self._valued()
        found = []
        for word in words:
            if found and found[-1] in valued and not word.startswith("--"):
                found[-1] += "=" + word
            else:
                found.append(word)
        return found

    def parse(self, words):
        return self.parse_args(self.joined(words))

    def _valued(self):
        """Returns the names of all options, of subcommands too, that take one value."""
        valued = set()
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction):
                valued.update(*(parser._valued() for parser in action.choices.values()))
            elif action.nargs is None:
                valued.update(action.option_strings)
        return valued


_LARGEST_WHOLE = 2**31 - 1  # that the native code takes


def whole_number(least):
    def parse(text):
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if value < least:
            raise argparse.ArgumentTypeError(f"{value} is less than {least}")
        if value > _LARGEST_WHOLE:
            raise argparse.ArgumentTypeError(f"{value} is more than {_LARGEST_WHOLE}")
        return value

    return parse


def file_name(text):
    """Parses the name of a file. An empty one, as from a variable that was never set, is no wish for no file."""
    if not text:
        raise argparse.ArgumentTypeError("the name of the file is empty")
    return text


def angle(text):
    """Parses an angle in degrees, from 1 to 180."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 1 <= value <= 180:
        raise argparse.ArgumentTypeError(f"{text!r} is not from 1 to 180")
    return value


def length(text):
    """Parses '1%' or '0.5'. Returns (number, whether it is in percent of size)."""
    match = re.fullmatch(rf"\s*({_NUMBER})\s*(%?)\s*", text, re.IGNORECASE)
    if not match:
        raise argparse.ArgumentTypeError(f"{text!r} is neither a length nor a percentage such as 1%")
    value = float(match[1])
    if not math.isfinite(value) or value <= 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number above 0")
    return value, bool(match[2])


def several(parse, least, most):
    """Returns a parser of values that commas separate. An error names the faulty one."""

    def parse_all(text):
        values = [parse(part) for part in text.split(",")]
        if not least <= len(values) <= most:
            raise argparse.ArgumentTypeError(f"{text!r} is not a list of {least} to {most} values")
        return values

    return parse_all


def above_zero(text):
    """Parses a finite number above 0."""
    value, percent = length(text)
    if percent:
        raise argparse.ArgumentTypeError(f"{text!r} is not a plain number")
    return value


def in_units(value_and_percent, size):
    value, is_percent = value_and_percent
    return value / 100 * size if is_percent else value


def require_within_size(tolerance, size, option="--tolerance"):
    """Raises Stop if a tolerance, a length, is more than the size of the reference."""
    if tolerance > size:
        raise Stop(f"{option}: {tolerance:.6g} is more than the size of the reference, {size:.6g}")


def require_folder(path, what):
    """Raises Stop before the work begins if a file cannot be written to this path. what: the option, for the message."""
    folder = Path(os.path.realpath(path)).parent
    if not folder.is_dir():
        raise Stop(f"{what} {path}: the folder {folder} does not exist")
    if Path(path).is_dir():
        raise Stop(f"{what} {path}: this is a folder")

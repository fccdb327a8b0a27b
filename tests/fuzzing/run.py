# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls the module for a case: with a time limit, on several numbers of threads, with a cancel, with refusals judged."""

import re
import threading
import time

import numpy as np
import tolvol

from .case import Finding

SECONDS = 10  # time limit of a call on a mesh for which calls are short
CANCEL_SECONDS = 0.5  # time limit after a cancel; 0.2 s are promised on a machine without other work


class Refused(Exception):
    """The module refused the case, as its documentation says."""


class Run:
    def __init__(self, case, tell=lambda step: None):
        self.case, self.tell = case, tell
        self.limited = case.is_limited()
        self.threads = case.options.get("threads", [1, 2])

    def call(self, name, function, threads=1):
        """Calls function(). It must not take too long by both the clock and the processor, which others may be using too."""
        self.tell(name)
        clock, processor = time.perf_counter(), time.process_time()
        try:
            return function()
        except (tolvol.InvalidInput, tolvol.ResourceLimit) as error:
            self._refuse(name, error)
        except tolvol.GlUnavailable as error:
            raise Refused(str(error)) from None
        except tolvol.Cancelled:
            raise Finding(f"cancelled: {name}", "Cancelled, though nobody asked for it") from None
        except Exception as error:
            raise Finding(f"exception: {name}", f"{type(error).__name__}: {error}") from error
        finally:
            seconds = min(time.perf_counter() - clock, (time.process_time() - processor) / threads)
            if self.limited and seconds > SECONDS:
                raise Finding(f"slow: {name}", f"{seconds:.1f} s")

    def repeated(self, name, call, fields, same=True):
        """Calls call(threads, progress) on several numbers of threads, and cancels one call in between.

        The results have to be the same bit for bit unless `same` is false.
        """
        started = time.perf_counter()
        first = self.call(name, lambda: call(self.threads[0], None), self.threads[0])
        seconds = time.perf_counter() - started
        share = self.case.options.get("cancel")
        if share is not None:
            self._cancel(name, call, share * seconds)
        if same:
            second = self.call(name, lambda: call(self.threads[1], None), self.threads[1])
            after = "" if share is None else ", with a call between them that was cancelled"
            self._require_same(name, first, second, fields, after)
        return first

    def repeated_in_steps(self, name, steps, fields):
        """Calls steps(threads), which makes several calls by call(), on several numbers of threads.

        The results have to be the same bit for bit.
        """
        first, second = (steps(threads) for threads in self.threads)
        self._require_same(name, first, second, fields)
        return first

    def _require_same(self, name, first, second, fields, after=""):
        for field in fields:
            if not np.array_equal(getattr(first, field), getattr(second, field)):
                raise Finding(f"threads: {name}", f"{field} differs on {self.threads} threads{after}")

    def volume(self):
        case = self.case
        return self.call(
            "ToleranceVolume",
            lambda: tolvol.ToleranceVolume(
                case.vertices,
                case.triangles,
                case.tolerance,
                to_world=case.to_world,
                precision=case.options.get("precision"),
                field=case.options.get("field", "scatter"),
                threads=self.threads[0],
            ),
            self.threads[0],
        )

    def _cancel(self, name, call, seconds):
        progress, outcome = tolvol.Progress(), []

        def work():
            try:
                call(self.threads[1], progress)
            except Exception as error:
                outcome.append(error)

        self.tell(f"{name}, cancelled")
        thread = threading.Thread(target=work)
        thread.start()
        thread.join(seconds)
        clock, processor = time.perf_counter(), time.process_time()
        progress.cancel()
        thread.join()
        taken = min(time.perf_counter() - clock, (time.process_time() - processor) / max(1, self.threads[1]))
        if outcome and not isinstance(outcome[0], tolvol.Cancelled):
            raise Finding(f"exception: {name}, cancelled", f"{type(outcome[0]).__name__}: {outcome[0]}")
        if taken > CANCEL_SECONDS:
            raise Finding(f"slow: {name}, cancelled", f"{taken:.2f} s after cancel()")

    def _refuse(self, name, error):
        for pattern, is_due in REFUSALS:
            if re.search(pattern, str(error)) and is_due(self.case):
                raise Refused(str(error)) from None
        raise Finding(f"refused: {name}", f"{type(error).__name__}: {error}") from error


def _has_no_faces(case):
    return not len(case.triangles)


def _has_no_area(case):
    a, b, c = case.world(case.vertices)[case.triangles].transpose(1, 0, 2) / (case.size() or 1)
    return (np.linalg.norm(np.cross(b - a, c - a), axis=1) <= 1e-12).all()


def _is_a_point(case):
    return case.longest_diagonal() < case.tolerance * 1.0001


def _rounds(case, unit):
    """Whether the rounding of the stored type, or of computations with it, comes near the tolerance."""
    matrix = 1 if case.to_world is None else np.abs(case.to_world[:3, :3]).sum()
    largest = max(np.abs(case.vertices).max() * matrix, np.abs(case.world(case.vertices)).max())
    return unit * largest > 0.01 * case.tolerance


# The refusals of the module, and the cases in which they are right.
REFUSALS = (
    ("no vertices|no faces", _has_no_faces),
    ("all faces are degenerate", _has_no_area),
    ("the domain of the lattice", lambda case: case.size() == 0),
    ("larger than the reference|single point|one point|no size", _is_a_point),
    (
        "too small for coordinates",
        lambda case: _rounds(case, 2.0**-24 if case.vertices.dtype == np.float32 else 2.0**-53),
    ),
    ("too small for double precision", lambda case: _rounds(case, 2.0**-45)),
    (
        "faces (of the reference )?are not within the tolerance",
        lambda case: case.options.get("moved", 0) and case.options["outside"] == "error",
    ),
    ("ResourceLimit|precision", lambda case: "precision" in case.options),
)

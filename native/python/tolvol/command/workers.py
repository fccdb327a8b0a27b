# SPDX-License-Identifier: GPL-3.0-or-later
"""Does the work in all cells of a round."""

from .progress_bar import followed


def here(title, work, jobs):
    """Yields work(job, progress) for all jobs, an iterable with a length, in this process and one after another."""
    for number, job in enumerate(jobs, 1):
        yield followed(f"{title}: {number} of {len(jobs)}", lambda progress, job=job: work(job, progress))

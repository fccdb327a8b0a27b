# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates a mesh that is larger than the memory, cell by cell, with a proof of the whole.

docs/architecture.md says why the proofs of the cells compose ("Cells of a large mesh").
"""

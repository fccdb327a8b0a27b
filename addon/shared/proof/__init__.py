# SPDX-License-Identifier: GPL-3.0-or-later
"""Certifies and measures the distances of a mesh from its reference, and reports them as text and files."""

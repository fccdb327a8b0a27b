# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads mesh files, checks them, and replaces files as a whole."""

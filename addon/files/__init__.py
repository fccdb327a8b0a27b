# SPDX-License-Identifier: GPL-3.0-or-later
"""Files: read, checked, and replaced only as a whole."""

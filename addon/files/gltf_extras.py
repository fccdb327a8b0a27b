# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the deviation of a level of detail into glTF files: Blender's exporter calls the class that is defined here."""

from ..shared.command.decimate import GEOMETRIC_ERROR  # also the name of the custom property


# The exporter looks for a class of this name in every add-on that is enabled.
class glTF2ExportUserExtension:  # noqa: N801
    def gather_node_hook(self, node, ob, _export_settings):
        """Called for each node that is written, whether or not custom properties are exported."""
        if ob is None or GEOMETRIC_ERROR not in ob:
            return
        # With custom properties exported, Blender also writes the settings of add-ons, which nobody reads.
        others = {key: value for key, value in (node.extras or {}).items() if key != "tolvol"}
        node.extras = {**others, GEOMETRIC_ERROR: ob[GEOMETRIC_ERROR]}

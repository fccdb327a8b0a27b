# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies the settings that an operator shares with the object on which it runs."""


def _in_order(names):
    """Sorts the unit of the tolerance first and its converted digits last: setting the other properties resets the digits."""
    return sorted(names, key=lambda name: (name != "tolerance_mode", name.endswith("_converted")))


def take(operator, settings, names):
    """Takes each property that was not given to the operator from `settings`."""
    for name in _in_order(names):
        if not operator.properties.is_property_set(name):
            setattr(operator, name, getattr(settings, name))


def give(operator, settings, names):
    """Stores the properties that the operator ran with in `settings`, so that the panel shows them."""
    for name in _in_order(names):
        setattr(settings, name, getattr(operator, name))


def draw_vertex_group(layout, settings, ob):
    row = layout.row(align=True)
    row.prop_search(settings, "vertex_group", ob, "vertex_groups", text="Group")
    row.prop(settings, "invert_vertex_group", text="", icon="ARROW_LEFTRIGHT")

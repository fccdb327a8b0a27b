# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties that an operator shares with the object it runs on."""


def _in_order(names):
    """The unit of the tolerance first and its converted digits last: what is set in between changes these."""
    return sorted(names, key=lambda name: (name != "tolerance_mode", name.endswith("_converted")))


def take(operator, settings, names):
    """What was not given to the operator is what `settings` has."""
    for name in _in_order(names):
        if not operator.properties.is_property_set(name):
            setattr(operator, name, getattr(settings, name))


def give(operator, settings, names):
    """What the operator ran with is what the panel shows from now on."""
    for name in _in_order(names):
        setattr(settings, name, getattr(operator, name))


def draw_vertex_group(layout, settings, ob):
    row = layout.row(align=True)
    row.prop_search(settings, "vertex_group", ob, "vertex_groups", text="Group")
    row.prop(settings, "invert_vertex_group", text="", icon="ARROW_LEFTRIGHT")

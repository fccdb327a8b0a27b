# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps why the last operation on an object was refused, for the panel Notes: Blender's popup closes as soon as the mouse
leaves it."""

import datetime

_last = {}  # name of an object -> (label of the operation, the reason, the time)


def keep(names, label, reason):
    """Remembers why an operation on the objects of these names was refused. label: the name of the operation."""
    for name in names:
        _last[name] = label, reason, datetime.datetime.now()


def forget(names):
    for name in names:
        _last.pop(name, None)


def forget_all():
    _last.clear()


def of(ob):
    """Returns a sentence about the last operation on `ob` if it was refused, or None."""
    if ob.name not in _last:
        return None
    label, reason, time = _last[ob.name]
    return f"{label} was refused at {time:%H:%M}: {reason}"

# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel with the sentences about the last operation and the mesh.

It is the last panel and becomes no shorter, so that its sentences, which come and go when an operation ends, move no button
of another panel.
"""

import datetime

import bpy

from ..estimate import memory
from ..job import refusals
from ..operators import blocked
from ..operators.decimate import blocked_others
from ..overlay import reasons
from ..proof import kept_warnings, last_run, verdict
from ..reference import measurements, snapshots
from ..shared.decimation import ISLANDS
from ..wrapping import text_lines
from .layout import AMBER, RED, SubPanel, active, keep_height

_MOST_OTHERS = 3


class TOLVOL_PT_notes(SubPanel, bpy.types.Panel):
    bl_label = "Notes"

    def draw(self, context):
        column = self.layout.column(align=True)
        lines, staying = notes(context, active(context))
        rows = sum([text_lines(context, column, text, icon) for text, icon in lines or [("No notes", "NONE")]])
        if staying:
            column.operator("tolvol.select_staying", text=f"Select {staying:,} Staying Vertices")
        keep_height(context, column, "Notes", rows + bool(staying))


def notes(context, ob):
    """Returns [(sentence, icon)], and the number of vertices that had to stay because UV islands meet there."""
    lines = []
    if reason := in_the_way(ob):
        lines.append((reason, "ERROR"))
    # The button Decimate is greyed, because it would decimate all selected meshes.
    others = [*blocked_others(context)] if ob.mode == "OBJECT" else []
    lines += [(reason, "ERROR") for reason in others[:_MOST_OTHERS]]
    if more := len(others[_MOST_OTHERS:]):
        lines.append((f"{more:,} more of the selected meshes cannot be decimated", "ERROR"))
    if needs := memory.told(ob):
        sentence, is_too_much = needs
        lines.append((sentence, "ERROR" if is_too_much else "INFO"))
    if refused := refusals.of(ob):
        lines.append((refused, "ERROR"))
    found = verdict.of(ob)
    if found is not None and found.kind != verdict.WITHIN:
        lines.append((found.line(), AMBER if found.passed else RED))
    if when := _measured_at(ob):
        lines.append((when, "TIME"))
    if on_top := measurements.on_top(ob):
        lines.append((f"The proof is for the base mesh, without its {' and '.join(on_top)}", "INFO"))
    if reason := _about_colours(ob):
        lines.append((reason, "INFO"))
    lines += _of_last_run(context, ob)
    warnings, staying = kept_warnings.of(ob)
    lines += [(warning, "ERROR") for warning in warnings]
    known = {ISLANDS, kept_warnings.ASKED_FOR}
    if others := [f"{count:,} by {cause}" for cause, count in staying.items() if cause not in known]:
        lines.append((f"Vertices that had to stay: {', '.join(others)}", "INFO"))
    return lines, staying.get(ISLANDS, 0)


def _measured_at(ob):
    """Returns when the mesh was measured as it is now, or None if it was not, or if an earlier version has measured it."""
    measured = measurements.measurement_of(ob)
    try:
        time = datetime.datetime.fromisoformat(measured.time if measured else "").astimezone()
    except ValueError:
        return None
    day = "" if time.date() == datetime.date.today() else f" on {time:%Y-%m-%d}"
    return f"Measured at {time:%H:%M}{day}"


def in_the_way(ob):
    """Why the mesh cannot be changed within the tolerance, or None. Outside Object Mode only the reference can be a reason."""
    if ob.mode == "OBJECT":
        return blocked.decimate_blocked(ob)
    return snapshots.reference_missing(ob) if ob.tolvol.snapshot else None


def _about_colours(ob):
    """Why the deviation is not shown as the settings demand, or None. A missing reference is said by in_the_way()."""
    if not ob.tolvol.show_deviation:
        return None
    if reason := reasons.off():
        return f"The deviation is not shown: {reason}"
    if snapshots.reference_missing(ob):
        return None
    return reasons.hidden(ob) or reasons.unsigned(ob)


def _of_last_run(context, ob):
    """Returns what is known about the last operation, until the mesh changes."""
    run = last_run.shown(ob)
    if not run:
        return []
    lines = last_run.remembered(run, context)
    if lines is None:
        return [("The report of the last operation is damaged: the next operation makes a new one", "ERROR")]
    return [(line, icon) for line, icon in zip(lines, ("CHECKMARK", "MESH_DATA")) if line]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels that show how far the mesh is from its reference: proved numbers, and the settings of the overlay."""

import bpy

from .. import job, measuring, overlay
from ..operators import blocked
from ..operators.original import TOLVOL_OT_show_original, shown
from ..operators.probe import TOLVOL_OT_probe, tolerance_of
from ..overlay import reasons
from ..proof import labels, probing, statistics, verdict
from ..shared.proof import report
from ..units import length
from ..wrapping import fitting, property_fields, text_lines, wrapped
from .layout import GHOST, GREEN, GREY, RED, SubPanel, active, is_narrow, right
from .progress import draw_progress


class TOLVOL_PT_deviation(SubPanel, bpy.types.Panel):
    bl_label = "Deviation"

    def draw(self, context):
        layout = self.layout
        ob = active(context)
        run, box = job.under_way(), layout.box()
        if run is not None and run.concerns(ob):
            draw_progress(context, box, run.told())
        else:
            _draw_verdict(context, box, ob, verdict.of(ob))
        # A narrow sidebar has no room for the two names beside each other.
        row = layout.column(align=True) if is_narrow(context) else layout.row(align=True)
        row.operator("tolvol.check")
        row.operator("tolvol.select_outside")
        row = layout.row(align=True)
        row.operator("tolvol.worst_point")
        for back, icon in ((True, "TRIA_LEFT"), (False, "TRIA_RIGHT")):
            row.operator("tolvol.next_place", text="", icon=icon).back = back
        row.operator("tolvol.clear_places", text="", icon="X")
        layout.operator("tolvol.probe", icon="EYEDROPPER", depress=TOLVOL_OT_probe.running())
        # Beside another button its name would have no room.
        layout.operator("tolvol.select_crossing")
        layout.operator("tolvol.save_report", text="Save Report...")
        row = layout.row(align=True)
        if shown() or TOLVOL_OT_show_original.poll(context):
            row.prop(context.window_manager, "tolvol_show_original", toggle=True)
        else:
            row.operator("tolvol.show_original")  # It is greyed, and its tooltip says why. That of a property cannot.
        row.operator("tolvol.restore_original", text="", icon="LOOP_BACK")
        row.operator("tolvol.new_original", text="", icon="DUPLICATE")


def _draw_verdict(context, box, ob, found):
    """Draws the same number of rows with and without a measurement."""
    narrow = is_narrow(context)
    row = box.row()
    row.scale_y, row.alert = 1.5, found is not None and not found.passed
    column = box.column(align=True)
    if found is None:
        row.label(text=verdict.NOT_CHECKED, icon=GREY)
        for line in (*wrapped(context, _why_not_checked(ob), most=3), "", "")[:3]:
            column.label(text=line)
        return
    row.label(text=found.word if narrow else f"{found.word}  {found.ways}", icon=GREEN if found.passed else RED)
    for text, way in (("Mesh", found.forward), ("Reference", found.backward)):
        _row(context, column, text, *_distance(context, way.upper, found.tolerance))
    size, share = abs(found.margin), found.margin_percent()
    left = ["almost 0"] if found.margin_is_little else _both(length(context, size), share)
    _row(context, column, "Margin" if found.passed else "Beyond by" if found.surely_beyond else "Unproved by", *left)


def _distance(context, value, tolerance):
    """Returns a proved distance as texts for a row: as a length and as a share of the tolerance, or as the share alone."""
    share = _share(value, tolerance)
    return [share] if verdict.negligible(value, tolerance) else _both(length(context, value), share)


def _both(size, share):
    """Returns a length and its share of the tolerance as texts for a row. The last one has only the share."""
    return [f"{size}  {share} of tolerance", f"{size}  {share}", f"{size} {share}", share]


def _share(value, tolerance):
    """Returns a proved distance as text, as a share of the tolerance."""
    return "almost 0" if verdict.negligible(value, tolerance) else report.percent(value, tolerance)


def _row(context, column, name, *texts):
    """Draws a name, and beside it the first of the texts that has room. A narrow sidebar has room for the last one."""
    narrow = is_narrow(context)
    factor = 0.55 if narrow else 0.38
    row = column.split(factor=factor)
    row.label(text=name)
    right(row, texts[-1] if narrow else fitting(context, *texts, share=1 - factor))


def _why_not_checked(ob):
    if measuring.wanted(ob):
        return measuring.failure(ob) or "Being measured"
    own = ob.tolvol.snapshot is None and ob.tolvol.reference_kind == "SELF"
    if own and not blocked.decimate_blocked(ob):
        return "Press Decimate, or set the reference first"  # The first operation sets the reference, too.
    return blocked.check_blocked(ob) or "Press Check to measure it"


class TOLVOL_PT_objects(SubPanel, bpy.types.Panel):
    """The verdicts of the selected meshes. It is there before they have a reference, so that no panel below moves then."""

    bl_label = "Selected Objects"
    bl_parent_id = "TOLVOL_PT_deviation"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and len(_listed(context)) > 1

    def draw(self, context):
        rows = verdicts(_listed(context))
        column, narrow = self.layout.column(align=True), is_narrow(context)
        for name, word, share in rows[:_MOST_LISTED]:
            row = column.split(factor=0.6 if narrow or share is not None else 0.5)
            row.label(text=name, icon=_ICONS_OF[word])
            if share is None:
                right(row, "\u2013" if narrow else word)  # A narrow sidebar has no room for both words of NOT CHECKED.
            else:
                right(row, word if narrow else f"{word}  {share}")
        if rest := [word for _, word, _ in rows[_MOST_LISTED:]]:
            more = ", ".join(f"{rest.count(word):,} {word}" for word in _ICONS_OF if word in rest)
            text_lines(context, column, f"and {more}", "BLANK1")


_MOST_LISTED = 20
# What needs attention comes first.
_ICONS_OF = {verdict.FAIL: RED, verdict.NOT_CHECKED: GREY, verdict.PASS: GREEN}


def _listed(context):
    return [ob for ob in context.selected_objects if ob.type == "MESH"]


def verdicts(objects):
    """Returns (name, word, share of the tolerance as text or None) for each object, in the order of the list."""
    rows = []
    for ob in objects:
        found = verdict.of(ob)
        rows.append((ob.name, verdict.word(ob), found and _share(found.largest, found.tolerance)))
    return sorted(rows, key=lambda row: ([*_ICONS_OF].index(row[1]), row[0]))


class TOLVOL_PT_show_deviation(SubPanel, bpy.types.Panel):
    """The settings of the overlay in the 3D view."""

    bl_label = "Show Deviation"
    bl_parent_id = "TOLVOL_PT_deviation"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        ob = active(context)
        self.layout.prop(ob.tolvol, "show_deviation", text="")
        # The overlay is not told of an object that was appended from another file.
        if ob.tolvol.show_deviation and not overlay.shows(ob) and not reasons.hidden(ob):
            bpy.app.timers.register(overlay.refresh, first_interval=0)

    def draw(self, context):
        ob = active(context)
        column = self.layout.column()
        column.active = ob.tolvol.show_deviation
        column.row().prop(ob.tolvol, "deviation_surface", expand=True)
        row = column.row()
        row.enabled = not reasons.unsigned(ob)
        row.prop(ob.tolvol, "deviation_kind", expand=True)
        column.prop(ob.tolvol, "deviation_opacity")
        legend = column.column()
        legend.use_property_split, legend.use_property_decorate = True, False
        property_fields(context, legend, ob.tolvol, "deviation_palette", "deviation_range")
        if ob.tolvol.deviation_range == "FIXED":
            legend.prop(ob.tolvol, "deviation_limit")
        row = legend.row(heading="Bands", align=True)
        row.prop(ob.tolvol, "use_bands", text="")
        count = row.row()
        count.active = ob.tolvol.use_bands
        count.prop(ob.tolvol, "band_count", text="")


# As in the legend.
_SIGNS = {probing.OUTSIDE: "+", probing.INSIDE: "\u2212"}
# The parts of the sidebar that an icon and the buttons, and the share and the buttons, leave to the text of a label.
_BESIDE_ICON, _BESIDE_SHARE = 0.5, 0.45


class TOLVOL_UL_labels(bpy.types.UIList):
    """The labels of an object: number, distance with its side, share of the tolerance. A ghost marks those on the reference."""

    def draw_item(self, context, layout, settings, label, _icon, _active, _name, index):
        ob = settings.id_data
        true = labels.current(ob, label)
        icon = "ERROR" if not true else GHOST if label.on_reference else "NONE"
        text = f"{index + 1}:  {_SIGNS.get(label.side, '')}{length(context, label.distance)}"
        # Beside an icon, and where the text needs the room, the share is left out. Where an icon leaves no room for the text,
        # the number stands alone. The 3D view shows the rest at the label.
        has_share = icon == "NONE" and bool(fitting(context, text, "", share=_BESIDE_SHARE))
        row = layout.split(factor=0.64) if has_share else layout.row()
        if icon != "NONE":
            text = fitting(context, text, f"{index + 1}", share=_BESIDE_ICON)
        row.active = true
        row.label(text=text, icon=icon)
        if has_share:
            right(row, report.percent(label.distance, tolerance_of(ob)))


class TOLVOL_PT_labels(SubPanel, bpy.types.Panel):
    """The labels that the probe has left. It is there before the first one, so that no panel below moves then."""

    bl_label = "Labels"
    bl_parent_id = "TOLVOL_PT_deviation"

    def draw_header_preset(self, context):
        if not active(context).tolvol.labels:
            self.layout.label(text="No labels")

    def draw(self, context):
        ob = active(context)
        row = self.layout.row()
        row.template_list("TOLVOL_UL_labels", "", ob.tolvol, "labels", ob.tolvol, "label_index", rows=3, maxrows=3)
        column = row.column(align=True)
        column.operator("tolvol.remove_label", text="", icon="REMOVE").everything = False
        column.operator("tolvol.remove_label", text="", icon="X").everything = True
        column.operator("tolvol.renew_labels", text="", icon="FILE_REFRESH")


class TOLVOL_PT_statistics(SubPanel, bpy.types.Panel):
    """Mean and the like of the deviation, both ways."""

    bl_label = "Statistics"
    bl_parent_id = "TOLVOL_PT_deviation"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        self.layout.operator("tolvol.measure_statistics", text="Measure")
        ob = active(context)
        found = statistics.of(ob)
        for title, way in (("Of the Mesh", "forward"), ("Of the Reference", "backward")):
            column = self.layout.box().column(align=True)
            column.label(text=title)
            for name, key in statistics.ROWS:
                texts = ["\u2013"]
                if found:
                    size = length(context, found[way][key])
                    texts = [*_both(size, report.percent(found[way][key], tolerance_of(ob)))[:-1], size]
                _row(context, column, name, *texts)

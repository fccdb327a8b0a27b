# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panels say, drawn without a window. tests/ui looks at them on the screen."""

from types import SimpleNamespace

import bpy
import pytest

from addon import native, panels, preferences, wrapping
from addon.job.progress_text import Told, stopping
from addon.mesh.mesh_io import triangle_count
from addon.panels import notes, progress
from addon.panels.layout import AMBER, GHOST, GREEN, GREY, RED
from addon.proof import verdict
from addon.units import length
from drawn import Layout, drawn, sidebar
from scenes import sheet, torus

TOLD = Told("Decimate in Tolerance", "", "Decimating", 0.25, "30 s left", "12,400 triangles left", "Cancel")


def with_reference(ob):
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    return ob


# Text that fits ------------------------------------------------------------------------------------------------------


def fits(line, width):
    return wrapping._width(line) <= wrapping._room(sidebar(width))


def test_lines_end_after_words_and_after_parts_of_a_path():
    text = "The module /opt/somewhere/tolerance_volumes/bin/tolvol/_native.so does not load: it is for another Python"
    lines = wrapping.wrapped(sidebar(240), text)
    assert len(lines) > 3 and all(fits(line, 240) for line in lines)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    assert wrapping.wrapped(sidebar(2000), text) == [text]


def test_too_many_lines_end_in_an_ellipsis():
    text = "The reference is out of date: another kind of reference was chosen, or another object"
    for most in (1, 2):
        lines = wrapping.wrapped(sidebar(240), text, most=most)
        assert len(lines) == most and lines[-1].endswith("\u2026") and all(fits(line, 240) for line in lines)
        assert text.startswith(" ".join(lines).removesuffix("\u2026"))
    ends = wrapping.wrapped(sidebar(240), "The reference is gone. Choose another one, and set it anew", most=1)
    assert ends[0].endswith("gone\u2026")
    assert wrapping.wrapped(sidebar(2000), text, most=1) == [text]


def names_of(panel, width):
    """Returns {property: how its name is drawn}, and the texts of the labels."""
    layout = drawn(panel, sidebar(width))
    named = {arguments[1]: options for name, arguments, options in layout.shown if name == "prop"}
    return named, [text for text, _ in layout.labels()]


NARROW, ENOUGH = 180, 230  # widths of the sidebar: it begins with about 220


def test_what_is_protected_has_room_in_a_narrow_sidebar():
    torus()
    named, labels = names_of(panels.TOLVOL_PT_protect, ENOUGH)
    assert named["only_selected"] == {"text": "Unselected"} and named["symmetry"] == {} and "Symmetry" not in labels
    named, labels = names_of(panels.TOLVOL_PT_protect, NARROW)
    assert named["only_selected"] == {"text": "Unselected Faces"} and "Symmetry" in labels
    assert named["symmetry"] == {"expand": True}  # Without names its buttons would be empty.


@pytest.mark.parametrize(
    ("panel", "name", "title"),
    [
        (panels.TOLVOL_PT_smooth, "method", "Method"),
        (panels.TOLVOL_PT_modifiers, "result", "Result"),
        (panels.TOLVOL_PT_show_deviation, "deviation_palette", "Colours"),
    ],
)
def test_the_choices_of_a_menu_have_room_in_a_narrow_sidebar(panel, name, title):
    ob = torus()
    ob.modifiers.new("SMOOTH", "SMOOTH")
    for width, above in ((ENOUGH, False), (NARROW, True)):
        named, labels = names_of(panel, width)
        assert named[name] == ({"text": ""} if above else {}) and (title in labels) == above


def test_buttons_have_room_in_a_narrow_sidebar():
    with_reference(torus())
    for width, text in ((ENOUGH, "Replace Reference..."), (NARROW, "Replace...")):
        panel = panels.TOLVOL_PT_tolerance
        layout = drawn(panel, sidebar(width), _other_form=panel._other_form)
        assert layout.buttons["tolvol.set_reference"] == text


def test_a_list_of_verdicts_has_room_in_a_narrow_sidebar():
    other = torus("other")
    with_reference(torus())
    other.select_set(True)
    for width, word in ((ENOUGH, "NOT CHECKED"), (NARROW, "\u2013")):
        assert [text for text, _ in drawn(panels.TOLVOL_PT_objects, sidebar(width)).labels()][1] == word


def test_the_levels_have_room_in_a_narrow_sidebar():
    ob = torus()
    assert bpy.ops.tolvol.make_lods() == {"FINISHED"}
    wide, narrow = (names_of(panels.TOLVOL_PT_lod, width)[1] for width in (ENOUGH, NARROW))
    triangles = [f"{triangle_count(level.data):,}" for level in (ob, *ob.tolvol.lods.objects)]
    deviations = [length(bpy.context, level["geometricError"]) for level in ob.tolvol.lods.objects]
    deviations.insert(0, "almost 0")  # The object is its own reference.
    assert wide == [*map("  ".join, zip(triangles, deviations))]
    assert narrow == [text for pair in zip(triangles, deviations) for text in pair]


def test_the_object_of_levels_has_a_deviation_once_it_is_measured():
    ob = torus()
    assert bpy.ops.tolvol.make_lods() == {"FINISHED"}
    ob.data.vertices[0].co.z += 0.25
    ob.data.update()
    bpy.context.view_layer.update()
    assert names_of(panels.TOLVOL_PT_lod, ENOUGH)[1][0].endswith("  \u2013")
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    assert names_of(panels.TOLVOL_PT_lod, ENOUGH)[1][0].endswith(f"  {length(bpy.context, verdict.of(ob).largest)}")


# A job under way -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("told", "width", "text"),
    [
        (TOLD, 400, "Decimate: 25%"),
        (TOLD, 120, "25%"),
        (
            Told("Decimate in Tolerance", "", "Reading the mesh", None, "", "", "Cancel"),
            400,
            "Decimate: Reading the mesh",
        ),
        (Told("Decimate in Tolerance", "", "Reading the mesh", None, "", "", "Cancel"), 150, "Reading the mesh"),
        (stopping("Decimate in Tolerance"), 400, "Decimate: Stopping"),
        (stopping("Decimate in Tolerance"), 120, "Stopping"),
        (stopping("", "torus, 1 of 2"), 400, "torus, 1 of 2: Stopping"),
    ],
)
def test_the_line_of_a_running_job_says_how_far_it_is(told, width, text):
    assert progress.in_a_row(sidebar(width), told) == text


def test_a_running_job_has_four_rows_and_a_bar_where_blender_has_one(monkeypatch):
    for bar in (False, True):
        monkeypatch.setattr(progress, "_HAS_BAR", bar)
        layout = Layout()
        progress.draw_progress(sidebar(), layout, TOLD)
        kind, options = ("progress", {"factor": 0.25}) if bar else ("label", {})
        assert layout.shown == [
            ("label", (), {"text": "Decimate", "icon": "SORTTIME"}),
            (kind, (), {"text": "Decimating (25%), 30 s left", **options}),
            ("label", (), {"text": "12,400 triangles left"}),
            ("label", (), {"text": "Esc: Cancel"}),
        ]
        # Without a share there is no bar, and where the time has no room it is left out.
        layout = Layout()
        progress.draw_progress(sidebar(), layout, stopping("Decimate in Tolerance"))
        assert [name for name, _, _ in layout.shown] == ["label"] * 4
        assert layout.labels() == [("Decimate", "SORTTIME"), ("Stopping", "NONE")]
        layout = Layout()
        progress.draw_progress(sidebar(200), layout, TOLD)
        assert layout.shown[1][2]["text"] == "Decimating (25%)"


NAMES = "Time Limit", "Largest Perimeter", "Crossings", "Normals", "Outside"


@pytest.mark.parametrize(("width", "above"), ((400, ()), (230, NAMES[1:2]), (190, NAMES[:3])))
def test_a_name_without_room_beside_its_field_is_above_it(width, above):
    torus()
    layout = drawn(panels.TOLVOL_PT_advanced, sidebar(width))
    assert [text for text, _ in layout.labels()] == list(above)
    fields = {arguments[1]: options for name, arguments, options in layout.shown if name == "prop"}
    properties = bpy.types.Object.bl_rna.properties["tolvol"].fixed_type.properties
    assert [properties[name].name for name in fields] == list(NAMES)
    assert {properties[name].name for name, options in fields.items() if options == {"text": ""}} == set(above)


@pytest.mark.parametrize("mode", ("PERCENT", "LENGTH"))
def test_a_narrow_panel_leaves_the_tolerance_room_for_its_unit(mode):
    torus().tolvol.tolerance_mode = mode
    for width, options in ((400, {}), (190, {"text": ""})):
        layout = drawn(panels.TOLVOL_PT_tolerance, sidebar(width), _other_form=lambda _context, _ob: "")
        assert ("prop", (bpy.context.object.tolvol, f"tolerance_{mode.lower()}"), options) in layout.shown


# What is in the way --------------------------------------------------------------------------------------------------


def status(ob):
    """Returns (text, icon) of the last line of the panel Tolerance, and the sentences of Notes."""
    layout = drawn(panels.TOLVOL_PT_tolerance, sidebar(900), _other_form=lambda _context, _ob: "")
    lines, _ = notes.notes(bpy.context, ob)
    return layout.labels()[-1], [text for text, _ in lines]


def test_the_panel_has_one_line_for_what_is_in_the_way_and_notes_the_whole_sentence():
    ob = torus()
    assert status(ob)[0] == ("No reference set", GREY)
    with_reference(ob)
    assert status(ob)[0] == ("2,304 triangles", GREEN)
    twin = ob.copy()
    said = f"2 users share the mesh {ob.data.name}: Object > Relations > Make Single User > Object & Data"
    (line, sentences) = status(ob)
    assert line == (said, AMBER) and said in sentences
    bpy.data.objects.remove(twin)
    ob.tolvol.reference_kind = "OBJECT"
    (line, sentences) = status(ob)
    assert line[1] == AMBER and line[0].startswith("The reference is out of date: another kind of reference was chosen")
    assert line[0] in sentences
    bpy.ops.object.mode_set(mode="EDIT")
    assert status(ob)[0] == line
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.scale.x = 0
    bpy.context.view_layer.update()
    assert status(ob)[0][1] == RED


def test_the_line_begins_with_what_is_in_the_way_where_it_is_cut():
    ob = torus()
    ob.data.name = "Icosphere.003 of a scan with a long name"
    twin = ob.copy()
    layout = drawn(panels.TOLVOL_PT_tolerance, sidebar(230), _other_form=lambda _context, _ob: "")
    assert layout.labels()[-1] == ("2 users share the mesh\u2026", AMBER)
    bpy.data.objects.remove(twin)


def test_without_an_active_mesh_the_panel_says_how_to_get_one():
    ob = torus()
    bpy.context.view_layer.objects.active = None
    assert drawn(panels.TOLVOL_PT_tolerance, sidebar(900)).labels() == [
        ("Shift-click a selected mesh to make it the active object", "INFO")
    ]
    ob.select_set(False)
    assert drawn(panels.TOLVOL_PT_tolerance, sidebar(900)).labels() == [("Select a mesh object", "INFO")]


def test_no_sentence_stands_between_or_above_buttons():
    ob = with_reference(torus())
    twin = ob.copy()  # Blocks all operations.
    for kind in ("SMOOTH", "SUBSURF", "CLOTH"):
        ob.modifiers.new(kind, kind)
    for name in ("sculpting", "editing", "lattice"):
        setattr(ob.tolvol.guard, name, True)
    ob.tolvol.deviation_surface = "REFERENCE"  # of which only the magnitude is shown
    for panel in (
        *(panels.TOLVOL_PT_decimate, panels.TOLVOL_PT_smooth, panels.TOLVOL_PT_deform, panels.TOLVOL_PT_lod),
        *(panels.TOLVOL_PT_modifiers, panels.TOLVOL_PT_guard, panels.TOLVOL_PT_show_deviation),
    ):
        shown = drawn(panel, sidebar()).shown
        pressed = [i for i, (name, _, _) in enumerate(shown) if name in {"operator", "prop", "prop_enum"}]
        sentences = [i for i, (name, _, options) in enumerate(shown) if name == "label" and " " in options["text"]]
        assert not [shown[i] for i in sentences if i < pressed[-1]], panel
    said = [text for text, _ in drawn(panels.TOLVOL_PT_modifiers, sidebar(2000)).labels()]
    assert "SUBSURF: This modifier changes the faces and has no setting to fit" in said
    assert "CLOTH: A simulation cannot be applied within the tolerance" in said
    said = [text for text, _ in drawn(panels.TOLVOL_PT_guard, sidebar(2000)).labels()]
    assert len(said) == 3 and said[0] == "The guard of sculpting takes effect in Sculpt Mode"
    bpy.data.objects.remove(twin)


def test_notes_say_why_the_colours_are_not_those_of_the_settings(monkeypatch):
    def said():
        return [text for text, _ in notes.notes(bpy.context, ob)[0]]

    ob = with_reference(sheet())
    assert "The deviation is not shown: Blender runs without a window" in said()
    monkeypatch.setattr(notes.reasons, "off", lambda: None)
    assert said() == []
    ob.tolvol.deviation_surface = "REFERENCE"
    assert said() == ["Only the magnitude is shown on the reference"]
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    assert said() == ["The deviation is shown only in Object, Edit and Sculpt Mode"]
    ob.tolvol.show_deviation = False
    assert said() == []


def why_not_checked():
    shown = drawn(panels.TOLVOL_PT_deviation, sidebar(900)).labels()
    assert shown[0][0] == "NOT CHECKED"
    return shown[1][0]


def test_not_checked_says_what_is_in_the_way_of_check():
    ob = torus()
    # The first operation sets the reference, too.
    assert why_not_checked() == "Press Decimate, or set the reference first"
    twin = ob.copy()
    assert why_not_checked() == "Set the reference first"
    bpy.data.objects.remove(twin)
    with_reference(ob)
    ob.data.vertices[0].co.x += 0.001
    ob.data.update()
    bpy.context.view_layer.update()
    assert why_not_checked() == "Press Check to measure it"
    ob.data.clear_geometry()
    assert why_not_checked() == "torus has no faces" and not bpy.ops.tolvol.check.poll()


def test_not_checked_names_decimate_only_where_no_other_mesh_could_be_too_far():
    other, ob = torus("other"), torus()
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", other
    assert why_not_checked() == "Set the reference first"


def test_not_checked_asks_for_no_reference_that_cannot_be_set():
    ob = torus()
    ob.tolvol.reference_kind = "OBJECT"
    assert why_not_checked() == "Choose the reference object" and not bpy.ops.tolvol.set_reference.poll()
    ob.tolvol.reference_kind = "SELF"
    ob.data.clear_geometry()
    assert why_not_checked() == "torus has no faces" and not bpy.ops.tolvol.set_reference.poll()


# Greyed buttons ------------------------------------------------------------------------------------------------------


def test_show_original_is_a_button_with_a_reason_while_there_is_nothing_to_show():
    ob = torus()
    layout = drawn(panels.TOLVOL_PT_deviation, sidebar())
    assert "tolvol.show_original" in layout.buttons and "tolvol_show_original" not in layout.properties()
    with_reference(ob)
    layout = drawn(panels.TOLVOL_PT_deviation, sidebar())
    assert "tolvol.show_original" not in layout.buttons and "tolvol_show_original" in layout.properties()


def test_clear_reference_says_why_it_is_greyed():
    torus()
    with pytest.raises(RuntimeError, match="No reference is set"):
        bpy.ops.tolvol.clear_reference()
    bpy.ops.object.light_add()
    with pytest.raises(RuntimeError, match="Select a mesh object"):
        bpy.ops.tolvol.clear_reference()


def test_the_number_of_stop_at_is_there_while_it_counts():
    ob = torus()
    assert "target_triangles" not in drawn(panels.TOLVOL_PT_decimate, sidebar()).properties()
    ob.tolvol.use_target = True
    assert "target_triangles" in drawn(panels.TOLVOL_PT_decimate, sidebar()).properties()


def test_the_tooltip_of_largest_perimeter_names_what_it_depends_on():
    for settings in (torus().tolvol, bpy.ops.tolvol.decimate.get_rna_type()):
        properties = getattr(settings, "bl_rna", settings).properties
        assert "Holes: Close is ticked under Decimate" in properties["largest_perimeter"].description


# Labels --------------------------------------------------------------------------------------------------------------


def items(width):
    """Returns [(text, icon) of the labels in a row of the list], for each label of the active object."""
    ob, rows = bpy.context.object, []
    for i, label in enumerate(ob.tolvol.labels):
        layout = Layout()
        drawing = panels.TOLVOL_UL_labels.draw_item
        drawing(None, sidebar(width), layout, ob.tolvol, label, 0, ob.tolvol, "label_index", i)
        rows.append(layout.labels())
    return rows


def test_the_panel_of_the_labels_is_there_before_the_first_one():
    ob = with_reference(torus())
    assert panels.TOLVOL_PT_labels.poll(bpy.context)

    def header():
        layout = Layout()
        panels.TOLVOL_PT_labels.draw_header_preset(SimpleNamespace(layout=layout), bpy.context)
        return layout.labels()

    assert header() == [("No labels", "NONE")]
    before = [name for name, _, _ in drawn(panels.TOLVOL_PT_labels).shown]
    assert bpy.ops.tolvol.add_label(position=(1, 0, 0)) == {"FINISHED"}
    assert len(ob.tolvol.labels) == 1 and header() == []
    assert [name for name, _, _ in drawn(panels.TOLVOL_PT_labels).shown] == before


def test_labels_keep_their_icons_in_a_narrow_sidebar():
    ob = with_reference(torus())
    for vertex in ob.data.vertices:
        vertex.co *= 1.01
    ob.data.update()
    for on_reference in (False, True):
        bpy.ops.tolvol.add_label(position=(1.25, 0, 0), on_reference=on_reference)
    (plain, ghost) = items(400)
    assert [icon for _, icon in plain] == ["NONE", "NONE"] and plain[1][0].endswith("%")
    assert [icon for _, icon in ghost] == [GHOST] and ghost[0][0].startswith("2:  ")
    assert items(150) == [plain[:1], [("2", GHOST)]]
    ob.data.vertices[0].co.z += 0.1
    ob.data.update()
    bpy.context.view_layer.update()
    assert [row[0][1] for row in items(400)] == ["ERROR", "ERROR"]
    assert items(150) == [[("1", "ERROR")], [("2", "ERROR")]]


# Rows of numbers -----------------------------------------------------------------------------------------------------


def test_a_row_says_of_what_its_percentage_is_where_it_has_room():
    with_reference(torus())
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}

    def shown(width):
        return [text for text, _ in drawn(panels.TOLVOL_PT_deviation, sidebar(width)).labels()]

    assert all(row.endswith("% of tolerance") for row in shown(900)[2::2][:3])
    assert not any("of tolerance" in row for row in shown(220)) and any(row.endswith("%") for row in shown(220))


# Preferences ---------------------------------------------------------------------------------------------------------


def test_the_preferences_break_long_lines(monkeypatch):
    def said(width):
        return [text for text, _ in drawn(preferences.TOLVOL_AP_preferences, sidebar(width)).labels()]

    path = str(native.path)
    assert len(said(300)) > 1 and all(fits(line, 300) for line in said(300))
    assert path in "".join(said(300)) and said(2000)[0].endswith(path)
    reason = "/opt/somewhere/with/a/long/path/_native.so does not load: it is made for another Python than this one"
    monkeypatch.setattr(native, "module", None)
    monkeypatch.setattr(native, "reason", reason)
    assert len(said(300)) > 1 and all(fits(line, 300) for line in said(300)) and said(2000) == [reason]

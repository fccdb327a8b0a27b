# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the legend, the labels and the box of the worst point draw in a 3D view, without a window."""

from types import SimpleNamespace

import bpy
import pytest

from addon.overlay import labels, legend, markers, shaders
from addon.overlay.scale import Scale
from addon.overlay.shares import Shares
from addon.proof.verdict import FAIL, PASS
from drawn import sidebar
from scenes import torus


class Page:
    """Takes what would be drawn. All letters are equally wide."""

    scale, ink, paper, room = 1.0, (1, 1, 1), (0, 0, 0, 1), 800

    def __init__(self, *_):
        self.rectangles, self.texts = [], []

    def rectangle(self, x, y, width, height, kind, colour=(0, 0, 0, 0), bands=0):
        self.rectangles.append((x, y, width, height, kind, tuple(colour)))

    def text(self, x, y, text, faint=False, points=11):
        self.texts.append(text)

    def width(self, text, points=11):
        return 0.6 * points * len(text)


def view(width=800, height=600):
    """A context of a 3D view in which no other region lies."""
    context = sidebar()
    context.region = SimpleNamespace(
        type="WINDOW", alignment="NONE", width=width, height=height, x=0, y=0, as_pointer=lambda: 1
    )
    context.area = SimpleNamespace(regions=[context.region])
    context.space_data = SimpleNamespace(as_pointer=lambda: 2)
    context.region_data = None
    return context


@pytest.fixture
def page(monkeypatch):
    """The page on which everything is drawn."""
    drawn = Page()
    monkeypatch.setattr(legend, "Page", lambda *_: drawn)
    monkeypatch.setattr(legend, "width_of", drawn.width)
    monkeypatch.setattr(markers.gpu.state, "blend_set", lambda _: None)
    yield drawn
    legend.free()


# The legend ----------------------------------------------------------------------------------------------------------


def draw_legend(context, histogram, name="torus"):
    scale = Scale(0.01, True, 0.01, 0)
    shares = Shares([0.25] * scale.counted, 0.0, histogram, 1.0)
    legend.draw(context, f"Deviation of {name}", "Colours not proved", PASS, "", scale, shares, "SAFE")


def test_the_histogram_has_a_bar_for_each_bin_at_its_height(page):
    histogram = [0.0, 0.5, 0.25, 0.0, 1e-9, 0.1]
    draw_legend(view(), histogram)
    x, y, _, height = next(drawn for drawn in page.rectangles if drawn[4] == shaders.BAR)[:4]
    bars = [drawn for drawn in page.rectangles if drawn[5] == (*page.ink, 0.5)]
    assert [bar[1] for bar in bars] == pytest.approx([y + i * height / 6 for i in (1, 2, 4, 5)])
    assert all(bar[3] == pytest.approx(height / 6) for bar in bars)
    # They grow to the left from the bar of colours, and the smallest one is a pixel long.
    assert all(bar[0] + bar[2] == pytest.approx(x - 2) for bar in bars)
    longest = legend._BINS_WIDTH - 2
    assert [bar[2] for bar in bars] == pytest.approx([longest, longest / 2, 1, longest / 5])


def test_a_long_name_of_an_object_does_not_make_the_legend_wide(page):
    for name, drawn in (("a part", "Deviation of a part"), ("p" * 63, f"Deviation of {'p' * 22}\u2026")):
        page.texts.clear()
        draw_legend(view(), [1.0], name)
        assert drawn in page.texts
        assert legend.box(view().region)[2] <= legend._HEADING + 2 * legend._GAP
    # A view that has no room for the whole name has room for the legend.
    page.texts.clear()
    draw_legend(view(width=600), [1.0], "p" * 63)
    assert len(page.texts) > 1


def test_a_note_without_room_is_the_word_alone(page):
    legend.draw_note(view(), "Deviation of torus: the field is being computed", FAIL)
    assert page.texts == [f"Deviation of torus: the field is being computed. {FAIL}"]
    page.texts.clear()
    legend.draw_note(view(width=220), "Deviation of torus: the field is being computed", FAIL)
    assert page.texts == [FAIL]
    left, bottom, width, height = legend.box(view(width=220).region)
    assert left >= 0 and left + width <= 220 and bottom >= 0


def test_the_tolerance_is_marked_on_the_bar_whatever_lies_beside_it():
    def labels_of(tolerance, signed):
        return dict(legend._labels(bpy.context, Scale(tolerance, signed, 1.0, 0), 0.13))

    for tolerance in (0.3, 0.45, 0.55, 0.8):
        found = labels_of(tolerance, False)
        assert found[tolerance].endswith(" (tolerance)")
        assert (0.5 in found) == (abs(tolerance - 0.5) > 0.13)
    # Beside an end there is no room for its text.
    assert labels_of(0.95, False)[0.95] == labels_of(0.01, False)[0.01] == ""
    found = labels_of(0.1, True)
    assert found[0.55] == found[0.45] == "" and found[0.5] == "0"
    assert labels_of(0.5, True)[0.75].startswith("+") and len(labels_of(1.0, False)) == 3


# Labels --------------------------------------------------------------------------------------------------------------


def overlaps(boxes):
    return [(a, b) for i, a in enumerate(boxes) for b in boxes[:i] if markers.overlap(a, b)]


def test_a_box_lies_beside_its_place_where_others_are_or_else_lower_and_stays_in_the_view(page):
    box = markers.Box(page, ["a line", "another line"])
    width, height = box.size
    assert box.beside(view(), 100, 300, 10) == (110, 300 - height / 2, width, height)
    assert box.beside(view(), 790, 300, 10)[0] == 780 - width
    assert box.beside(view(), 100, 599, 10)[1] == 600 - height and box.beside(view(), 100, 0, 10)[1] == 0
    # One after another of the four sides is taken.
    level, middle, others = 300 - height / 2, 400 - width / 2, []
    for left, bottom in ((410, level), (390 - width, level), (middle, 310), (middle, 290 - height)):
        assert box.beside(view(), 400, 300, 10, others) == (left, bottom, width, height)
        others.append((left + width / 2, bottom + height / 2, 1, 1))
    others = [(100, 290, 50, 400), (100, 290 - height, 500, 30), (0, 0, 50, 500)]
    placed = box.beside(view(), 100, 300, 10, others)
    assert placed[1] < 290 - height - height and not overlaps([placed, *others[:2]])
    assert box.beside(view(), 100, 300, 10, [(0, 5, 800, 500)]) is None


def test_a_box_lies_beside_the_toolbar_and_the_sidebar_and_not_under_them(page):
    context = view(width=400)
    for kind, alignment, x, width in (("TOOLS", "LEFT", 0, 50), ("UI", "RIGHT", 300, 100)):
        other = SimpleNamespace(type=kind, alignment=alignment, width=width, height=600, x=x, y=0)
        context.area.regions.append(other)
    assert legend.free_part(context) == (50, 300, 0)
    page.room = 250
    box = markers.Box(page, ["a line of so many letters", "another"])
    width, height = box.size
    assert 150 < width < 250
    # Neither side of the place has room for it: it lies above, and below where nothing is above.
    for y, bottom in ((300, 310), (595, 585 - height)):
        left, low, *size = box.beside(context, 180, y, 10)
        assert left >= 50 and left + width <= 300 and low == bottom and size == [width, height]
    # A line that is wider than the view is cut.
    box = markers.Box(page, ["a line of very many letters that has no room in so narrow a view"])
    assert box.size[0] <= 250 and box._lines[0].endswith("\u2026")


class InView:
    """An object that is seen in a view, although Blender has none."""

    def __init__(self, ob):
        self._ob = ob

    def __getattr__(self, name):
        return getattr(self._ob, name)

    def visible_in_viewport_get(self, _space):
        return True


def drawn_labels(page, monkeypatch, ob, *others):
    """Returns the boxes and the first lines of the labels of `ob`, all at one place, beside other boxes."""
    monkeypatch.setattr(markers, "in_view", lambda *_: (300, 250))
    boxes, firsts = [], []
    monkeypatch.setattr(
        markers.Box, "draw", lambda box, place, faint=False: (boxes.append(place), firsts.append(box._lines[0]))
    )
    context = view()
    context.active_object = InView(ob)
    labels.draw(context, page, [*others])
    assert overlaps([*boxes, *others]) == []
    return boxes, firsts


def test_labels_lie_neither_over_each_other_nor_over_the_legend_nor_over_the_worst_point(page, monkeypatch):
    ob = torus()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for i in range(12):
        assert bpy.ops.tolvol.add_label(position=(1.25, 0, 0.001 * i)) == {"FINISHED"}
    ob.tolvol.label_index = 5
    boxes, firsts = drawn_labels(page, monkeypatch, ob, (250, 20, 550, 100), (320, 185, 250, 40))
    # The chosen label is whole and beside its place, others are on its other sides, and some below the worst point.
    assert "of the tolerance" in firsts[0] and len(firsts) > 5
    assert [first.split(":")[0] for first in firsts] == [str(i) for i in (6, 1, 2, 3, 4, 5, 7, 8, 9)][: len(firsts)]
    assert boxes[0][1] == 250 - 21 and boxes[1][0] + boxes[1][2] < 300 and any(120 <= box[1] < 185 for box in boxes)
    # Where the lines have no room, but the number has, it is drawn alone.
    boxes, firsts = drawn_labels(page, monkeypatch, ob, (340, 0, 460, 600), (0, 0, 270, 600))
    assert firsts[:4] == ["6", "1", "2", "3"] and all(270 <= box[0] and box[0] + box[2] <= 340 for box in boxes)


# Marks ---------------------------------------------------------------------------------------------------------------


def test_what_is_outside_the_view_is_not_drawn(monkeypatch):
    seen = []
    monkeypatch.setattr(markers, "location_3d_to_region_2d", lambda *_: seen[-1])
    for spot in ((-1, 5), (801, 5), (5, -1), (5, 601), None):
        seen.append(spot)
        assert markers.in_view(view(), (0, 0, 0)) is None
    seen.append((800, 0))
    assert markers.in_view(view(), (0, 0, 0)) == (800, 0)


def test_crosses_do_not_lie_over_what_is_drawn_and_the_box_only_without_other_room(page, monkeypatch):
    ob = torus()
    ob.tolvol.tolerance_percent = 0.5
    assert bpy.ops.tolvol.set_reference() == bpy.ops.tolvol.worst_point() == {"FINISHED"}
    monkeypatch.setattr(markers, "in_view", lambda *_: (300, 250))
    context = view()
    context.active_object, context.scene = InView(ob), bpy.context.scene
    whole = markers.draw(context, page, [])
    crosses = len(page.rectangles)
    assert crosses > 8 and whole[0] > 300
    page.rectangles.clear()
    corner = (280, 230, 40, 40)
    assert markers.draw(context, page, [corner]) == whole and len(page.rectangles) < crosses - 7
    below = markers.draw(context, page, [whole])
    assert not overlaps([below, whole])
    assert markers.draw(context, page, [(0, 0, 800, 600)]) == whole


def test_what_the_probe_reads_lies_beside_the_labels(page, monkeypatch):
    drawn = []
    monkeypatch.setattr(markers.Box, "draw", lambda box, place, faint=False: drawn.append(place))
    hover = SimpleNamespace(region=1, lines=["0.1 mm outside"], position=None, mouse=(300, 250))
    labels.draw_hover(view(), page, hover, [])
    labels.draw_hover(view(), page, hover, [drawn[0]])
    assert len(drawn) == 2 and not overlaps(drawn)

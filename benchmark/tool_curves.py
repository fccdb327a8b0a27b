# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws triangles against the tolerance: those of Tolerance Volumes, of the best other tool, and of the theory."""

import math

from tool_calls import TOOLS
from tool_page import kept

OWN = {"ours": "Tolerance Volumes, fast", "thorough": "Tolerance Volumes, thorough"}
NAMES = {"bunny_closed": "Stanford bunny, closed"}
CONVEX = {"sphere": 4 * math.pi}  # the integral that smooth_optimum() takes


def smooth_optimum(tolerance, convex):
    """Returns how many triangles a smooth convex surface needs within a small tolerance.

    They are equilateral as the curvature measures lengths, with corners that are a tolerance outside and centres that are a
    tolerance inside. `convex` is the integral of the root of the Gaussian curvature over the surface, in the unit of the
    tolerance.
    """
    return convex / (3 * math.sqrt(3) * tolerance)


def best_of_others(case):
    """Returns (triangles, name) of the fewest triangles that another tool left and that kept both directions, or None.

    The result for the tolerance counts as well as the fewest found by the search.
    """
    found = []
    for name, entry in case["tools"].items():
        if TOOLS[name].package != "tolvol":
            if kept(entry) == "both":
                found.append((entry["triangles"], name))
            if "triangles" in entry.get("search", {}):
                found.append((entry["search"]["triangles"], name))
    return min(found, default=None)


def curves(cases):
    """Returns {mesh: {"ours", "thorough", "others", "theory": [(percent, triangles, name), ...], from wide to narrow}}.

    The name is that of the tool, and None for the theory. The list of the theory is empty if its integral is not known.
    """
    found = {}
    for case in sorted(cases, key=lambda case: -case["percent"]):
        lines = found.setdefault(case["mesh"], {key: [] for key in (*OWN, "others", "theory")})
        percent = case["percent"]
        for name in OWN:
            if kept(case["tools"].get(name, {})) == "both":
                lines[name].append((percent, case["tools"][name]["triangles"], name))
        best = best_of_others(case)
        if best:
            lines["others"].append((percent, *best))
        if case["mesh"] in CONVEX:
            lines["theory"].append((percent, smooth_optimum(case["tolerance"], CONVEX[case["mesh"]]), None))
    return found


BLUE, ORANGE, GREY = "#0072B2", "#D55E00", "#666666"
LOOKS = {  # of a line: (colour, marker, style, text)
    "others": (ORANGE, "s", "-", "best other tool"),
    "ours": (BLUE, "o", "-", "fast"),
    "thorough": ("#000000", "D", "-", "thorough"),
    "theory": (GREY, "", "--", "theory"),
    "slope": (GREY, "", ":", "slope of theory"),
}
NARROWEST_GAP = 0.17  # between the texts of two lines, in powers of ten


def draw_curves(cases, picture):
    """Draws a panel for each mesh, with the narrow tolerances on the right.

    Beside the name of the best other tool stands how many times the triangles of thorough it leaves.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    found = curves(cases)
    figure, axes = pyplot.subplots(1, len(found), figsize=(6 * len(found), 5.2), sharey=True, squeeze=False)
    for axis, (mesh, lines) in zip(axes[0], found.items()):
        triangles = next(case["triangles"] for case in cases if case["mesh"] == mesh)
        axis.set_title(f"{NAMES.get(mesh, mesh.capitalize())}, {triangles:,} triangles", fontsize=14)
        panel(axis, lines)
    axes[0, 0].set_ylabel("triangles left", fontsize=13)
    figure.tight_layout()
    figure.savefig(picture, dpi=110)
    pyplot.close(figure)


def panel(axis, lines):
    percents = sorted({point[0] for points in lines.values() for point in points}, reverse=True)
    if not lines["theory"]:  # Its slope is shown where its height is not known.
        lines = {**lines, "slope": slope(lines["thorough"] or lines["ours"], percents)}
    axis.set_xscale("log")
    axis.set_yscale("log")
    drawn = {key: points for key, points in lines.items() if points}
    for key, points in drawn.items():
        colour, marker, style, _ = LOOKS[key]
        x, y = [point[0] for point in points], [point[1] for point in points]
        axis.plot(x, y, style, marker=marker, color=colour, markersize=7, linewidth=1.8)
    heights = spread({key: math.log10(points[-1][1]) for key, points in drawn.items()})
    for key, height in heights.items():
        beside = {"textcoords": "offset points", "va": "center", "color": LOOKS[key][0], "fontsize": 13}
        axis.annotate(LOOKS[key][3], (drawn[key][-1][0], 10**height), (10, 0), **beside)
    own = {percent: triangles for percent, triangles, _ in lines["thorough"]}
    for percent, triangles, name in lines["others"]:
        text = TOOLS[name].title.split(",")[0]
        if percent in own:
            text += f", {triangles / own[percent]:.1f} ×"
        above = {"textcoords": "offset points", "ha": "right", "color": ORANGE, "fontsize": 12}
        axis.annotate(text, (percent, triangles), (-4, 6), **above)
    axis.set_xticks(percents, [f"{percent:g}" for percent in percents], fontsize=12)
    axis.set_xticks([], minor=True)
    axis.tick_params(axis="y", labelsize=12)
    axis.set_xlim(16 * percents[0], percents[-1] / 36)
    axis.margins(y=0.08)
    axis.set_xlabel("tolerance, % of size", fontsize=13)
    axis.grid(True, color="#E4E4E4", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)


def spread(heights, gap=NARROWEST_GAP):
    """Returns the heights {name: height} moved apart, so that none is nearer than the gap to the next one above it."""
    moved, last = {}, math.inf
    for name in sorted(heights, key=heights.get, reverse=True):
        last = moved[name] = min(heights[name], last - gap)
    return moved


def slope(points, percents, below=0.5):
    """Returns points of a line with the slope of the theory, below all the given ones."""
    if not points:
        return []
    height = below * min(percent * triangles for percent, triangles, _ in points)
    return [(percent, height / percent, None) for percent in percents]

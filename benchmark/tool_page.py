# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the rows of the table and the plot of the comparison with other tools."""

import tables
from tool_calls import TOOLS

HEADS = ["Tool", "Triangles", "Seconds", "Result → reference", "Reference → result", "Kept"]
HEADS += ["Fewest kept", "Search, s"]


def kept(entry):
    """Returns the proved directions: "both", "forward" (the result is near the reference), "backward", or "no"."""
    forward, backward = (entry.get(way) is not None and entry[way][1] <= 1 for way in ("forward", "backward"))
    return {(True, True): "both", (True, False): "forward", (False, True): "backward"}.get((forward, backward), "no")


def seconds(value):
    return f"{value:.2f}" if value < 10 else f"{value:.0f}"


def distance(interval):
    if interval is None:
        return ""
    text = f"{interval[1]:.3f}" if interval[1] < 100 else "over 100"
    return f"**{text}**" if interval[1] <= 1 else text


def row(name, entry):
    if "failure" in entry:
        return [TOOLS[name].title, entry["failure"].replace("|", "/"), *[""] * (len(HEADS) - 2)]
    found = entry.get("search")
    return [
        TOOLS[name].title,
        f"{entry['triangles']:,}",
        seconds(entry["seconds"]),
        distance(entry.get("forward")),
        distance(entry.get("backward")),
        kept(entry),
        "" if found is None else f"{found['triangles']:,}" if "triangles" in found else "none",
        "" if found is None else seconds(found["seconds"]),
    ]


def title(case):
    return f"{case['mesh']}, {case['triangles']:,} triangles, ε = {case['percent']:g} %"


def text(figures):
    rows = []
    for case in figures["cases"]:
        rows.append([f"***{title(case)}***"] + [""] * (len(HEADS) - 1))
        rows += [row(name, entry) for name, entry in case["tools"].items()]
    used = {TOOLS[name].package for case in figures["cases"] for name in case["tools"]}
    numbers = [f"{package} {number}" for package, number in sorted(figures["versions"].items()) if package in used]
    threads = "1 thread" if figures["threads"] == 1 else f"{figures['threads']} threads"
    where = f"{figures['machine']}, {threads}; {', '.join(numbers)}."
    return f"{where}\n\n{tables.table(HEADS, rows, 'lrrrrlrr')}"


BLUE, ORANGE, GREEN, PURPLE, SKY, GREY = "#0072B2", "#D55E00", "#009E73", "#AA4499", "#56B4E9", "#777777"
LOOKS = {  # name: (colour, marker); the markers tell the tools apart without colours
    "ours": ("#000000", "D"),
    "thorough": ("#000000", "*"),
    "cgal": (ORANGE, "s"),
    "manifold3d": (GREY, "v"),
    "meshlib": (BLUE, "o"),
    "meshlib-weighted": (BLUE, "p"),
    "meshoptimizer": (GREEN, "^"),
    "open3d": (PURPLE, "<"),
    "openmesh": (GREEN, "h"),
    "pyfqmr": (SKY, ">"),
    "pymeshlab": (PURPLE, "d"),
    "pytetwild": (ORANGE, "X"),
    "pytetwild-long": (ORANGE, "P"),
    "vtk-pro": (SKY, "s"),
    "vtk-quadric": (GREY, "8"),
}


def draw(cases, picture):
    """Draws triangles against seconds, with a row for each tolerance and a column for each mesh."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.lines import Line2D

    meshes = list(dict.fromkeys(case["mesh"] for case in cases))
    percents = list(dict.fromkeys(case["percent"] for case in cases))
    height = 3.1 * len(percents)
    figure, axes = pyplot.subplots(
        len(percents), len(meshes), figsize=(12, height + 1.7), sharey=True, sharex="row", squeeze=False
    )
    figure.subplots_adjust(left=0.06, right=0.99, top=1 - 0.3 / (height + 1.7), hspace=0.32, wspace=0.05)
    figure.subplots_adjust(bottom=1.9 / (height + 1.7))
    for case in cases:
        axis = axes[percents.index(case["percent"]), meshes.index(case["mesh"])]
        axis.set_title(title(case), fontsize=10)
        for name, entry in case["tools"].items():
            if name in LOOKS and "failure" not in entry:
                mark(axis, *LOOKS[name], entry)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.grid(True, color="#E4E4E4", linewidth=0.6)
        axis.set_axisbelow(True)
    for axis in axes[-1]:
        axis.set_xlabel("triangles")
    for axis in axes[:, 0]:
        axis.set_ylabel("seconds")

    def sample(colour, marker, filled, label):
        face = colour if filled else "white"
        return Line2D([], [], linestyle="", marker=marker, color=colour, markerfacecolor=face, label=label)

    shown = [name for name in LOOKS if any(name in case["tools"] for case in cases)]
    handles = [sample(*LOOKS[name], True, TOOLS[name].title.replace("**", "")) for name in shown]
    handles += [
        sample("#444444", "o", True, "filled: both directions kept, proved"),
        sample("#444444", "o", False, "hollow: not kept"),
        Line2D([], [], color="#444444", linewidth=0.8, marker=".", label="line: to the fewest found by search"),
    ]
    figure.legend(handles=handles, loc="lower center", ncol=4, fontsize=9, frameon=False)
    figure.savefig(picture, dpi=110)
    pyplot.close(figure)


def mark(axis, colour, marker, entry):
    """Draws a large mark for the result for the tolerance, and a line to a small mark for the fewest found by the search.

    For a tool whose result for the tolerance has no triangles, only the small mark is drawn.
    """
    x, y = entry["triangles"], entry["seconds"]
    found = entry.get("search", {})
    if "triangles" in found:
        axis.plot(found["triangles"], found["call"], marker, color=colour, markersize=4)
        if x:
            axis.plot([x, found["triangles"]], [y, found["call"]], color=colour, linewidth=0.8, alpha=0.6)
    if x:
        face = colour if kept(entry) == "both" else "white"
        axis.plot(x, y, marker, color=colour, markerfacecolor=face, markersize=12 if marker == "*" else 8, zorder=3)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the rows of the table and the plot of the comparison with other tools."""

import tables
from tool_calls import TOOLS

SOLID = "Closed, no crossings"
HEADS = ["Tool", "Triangles", "Processor s", "Result → reference", "Reference → result", "Kept", SOLID]
HEADS += ["Fewest kept", SOLID]


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


def solidity(entry):
    """Returns "yes" for a closed mesh without crossings, or the reasons why a mesh is none, or "" without a judgement."""
    found = entry.get("solid")
    if found is None:
        return ""
    if found["crossings"] is None:
        return "no manifold"
    reasons = [] if found["closed"] else ["open"]
    if found["crossings"]:
        reasons.append(f"{found['crossings']:,} crossings" if found["crossings"] > 1 else "1 crossing")
    return ", ".join(reasons) or "yes"


def row(name, entry):
    if "failure" in entry:
        return [TOOLS[name].title, entry["failure"].replace("|", "/"), *[""] * (len(HEADS) - 2)]
    found = entry.get("search")
    return [
        TOOLS[name].title,
        f"{entry['triangles']:,}" if "triangles" in entry else "",
        seconds(entry["seconds"]) if "seconds" in entry else "",
        distance(entry.get("forward")),
        distance(entry.get("backward")),
        kept(entry) if "triangles" in entry else "",
        solidity(entry),
        "" if found is None else f"{found['triangles']:,}" if "triangles" in found else "none",
        solidity(found or {}),
    ]


def title(case):
    return f"{case['mesh']}, {case['triangles']:,} triangles, ε = {case['percent']:g} %"


def text(figures):
    rows = []
    for case in figures["cases"]:
        rows.append([f"***{title(case)}***"] + [""] * (len(HEADS) - 1))
        rows[-1][HEADS.index(SOLID)] = f"*input: {solidity(case)}*"
        rows += [row(name, entry) for name, entry in case["tools"].items()]
    used = {TOOLS[name].package for case in figures["cases"] for name in case["tools"]}
    numbers = [f"{package} {number}" for package, number in sorted(figures["versions"].items()) if package in used]
    threads = "1 thread" if figures["threads"] == 1 else f"{figures['threads']} threads"
    where = f"{figures['machine']}, {threads}; {', '.join(numbers)}."
    return f"{where}\n\n{tables.table(HEADS, rows, 'lrrrrllrl')}"


BLUE, ORANGE, GREEN, PURPLE, SKY, GREY = "#0072B2", "#D55E00", "#009E73", "#AA4499", "#56B4E9", "#777777"
LOOKS = {  # name: (colour, marker); the markers tell the tools apart without colours. A tuple: corners, kind, turn
    "ours": ("#000000", "D"),
    "thorough": ("#000000", "*"),
    "blender-collapse": (PURPLE, "H"),
    "blender-planar": (PURPLE, (3, 1, 0)),
    "cgal": (ORANGE, "s"),
    "libigl": (ORANGE, (4, 1, 0)),
    "manifold3d": (GREY, "v"),
    "meshlib": (BLUE, "o"),
    "meshlib-weighted": (BLUE, "p"),
    "meshoptimizer": (GREEN, "^"),
    "open3d": (PURPLE, "<"),
    "opengl-decimate": (BLUE, (6, 1, 0)),
    "openmesh": (GREEN, "h"),
    "pyfqmr": (SKY, ">"),
    "pymeshlab": (PURPLE, "d"),
    "pytetwild": (ORANGE, "X"),
    "pytetwild-long": (ORANGE, "P"),
    "trueform": (GREEN, (5, 0, 180)),
    "vtk-pro": (SKY, (8, 1, 0)),
    "vtk-quadric": (GREY, "8"),
}


def draw(cases, picture):
    """Draws triangles against processor seconds, with a row for each tolerance and a column for each mesh."""
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
        axis.set_ylabel("processor seconds")

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

    For a tool without a result for the tolerance, or whose result has no triangles, only the small mark is drawn.
    """
    x, y = entry.get("triangles"), entry.get("seconds")
    found = entry.get("search", {})
    if "triangles" in found:
        axis.plot(found["triangles"], found["call"], marker=marker, color=colour, markersize=4)
        if x:
            axis.plot([x, found["triangles"]], [y, found["call"]], color=colour, linewidth=0.8, alpha=0.6)
    if x:
        face = colour if kept(entry) == "both" else "white"
        axis.plot(
            x, y, marker=marker, color=colour, markerfacecolor=face, markersize=12 if marker == "*" else 8, zorder=3
        )

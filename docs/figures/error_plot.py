# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots error against grid spacing for exact scatter, scatter in GL, fast marching and a permission grid on three shapes.

blender --background --python docs/figures/error_plot.py -- PICTURE.png

The shapes are a sphere, a box and Blender's monkey. The upper row shows the difference between the trilinear interpolation
of the grid and the exact distance, at random points within the tolerance. The lower row shows the effect on a check: along
random rays from the surface, the difference between the tolerance and the exact distance where the ray first leaves the
represented volume. Closed references are interpolated with signs. The monkey has open eye sockets and is interpolated
without signs: its boundary is extruded, and signed values would jump there.

The paper says that the error falls like h^2. For exact values this is so where the distance is smooth: on the sphere, and
in the mean on the other shapes. At the medial axis, which reaches the surface along every convex edge, the distance has a
kink, and without signs also at the surface itself. There the largest error falls like h. Fast marching is of first order
at best, with any interpolation: at the corners of the box its error is a whole spacing. A permission grid is of first
order, too. It loses about a spacing everywhere, in the mean 40 to 800 times as much as interpolated exact values.
"""

import sys
from pathlib import Path

import bmesh
import bpy
import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parents[1] / "blender_scripts")]
import command_line as cli  # noqa: E402
import models  # noqa: E402
from addon.native import module as tolvol  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "build" / "release" / "python"))

TOLERANCE = 0.03  # as a share of the size
REACH = 2  # tolerances that the fields reach, so that all corners of the cells around the tolerance have values
# Nodes per tolerance; the last one makes the finest grid that the memory budget permits.
PRECISIONS = np.geomspace(2, 11.3, 6)
FINEST_GL = 5  # A finer grid takes llvmpipe many minutes.
POINTS, RAYS = 100_000, 4_000
SEED = 2004

METHODS = {  # name: (colour, marker); the markers tell the methods apart without colours
    "scatter": ("#0072B2", "o"),
    "scatter in GL": ("#56B4E9", "x"),
    "fast marching": ("#D55E00", "s"),
    "permission grid": ("#222222", "^"),
}
FIELDS = {"scatter": "scatter", "scatter in GL": "gl", "fast marching": "fast_marching"}


def new_mesh(fill):
    """Returns (vertices, triangles) of the mesh that fill(bmesh) makes."""
    mesh, bm = bpy.data.meshes.new("shape"), bmesh.new()
    fill(bm)
    bmesh.ops.triangulate(bm, faces=bm.faces)
    bm.to_mesh(mesh)
    bm.free()
    return models.arrays(bpy.data.objects.new("shape", mesh))


def suzanne(bm):
    """Adds Blender's monkey to a bmesh, subdivided, without the noise that models.py adds."""
    bpy.ops.mesh.primitive_monkey_add(calc_uvs=False)
    ob = bpy.context.object
    ob.modifiers.new("subdivision", "SUBSURF").levels = 2
    bm.from_object(ob, bpy.context.evaluated_depsgraph_get())


SHAPES = {  # name: (how to make it, whether it is closed)
    "sphere": (lambda bm: bmesh.ops.create_icosphere(bm, subdivisions=8, radius=1), True),
    "box": (lambda bm: bmesh.ops.create_cube(bm, size=1), True),
    "Suzanne": (suzanne, False),
}


def surface_points(vertices, triangles, count, rng):
    corners = vertices[triangles].astype(np.float64)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = corners[rng.choice(len(triangles), count, p=area / area.sum())]
    return np.einsum("pk,pkd->pd", rng.dirichlet((1, 1, 1), count), chosen)


def directions(count, rng):
    d = rng.standard_normal((count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def interpolation(volume, signed):
    """Returns a function of points: the magnitude of the trilinear interpolation of a volume's grid."""
    values, origin, spacing, unit = volume.grid(signed=signed)
    values = np.ascontiguousarray(values if signed else np.abs(values))

    last = np.array(values.shape[::-1]) - 1

    def at(points):
        node = np.clip((points - origin) / spacing, 0, last - 1e-9)  # outside the grid, the value at its border
        low = node.astype(np.int64)
        weight = np.stack([1 - (node - low), node - low])
        result = 0
        for i, j, k in np.ndindex(2, 2, 2):
            x, y, z = (low + [i, j, k]).T
            result += values[z, y, x] * weight[i, :, 0] * weight[j, :, 1] * weight[k, :, 2]
        return unit * np.abs(result)

    return at


def first_exit(inside, start, direction, reach):
    """Returns the points where rays first leave the set given by inside(points), for rays that leave it within `reach`."""
    steps = np.linspace(0, reach, 129)
    stays = np.stack([inside(start + t * direction) for t in steps])
    leaves = ~stays.all(axis=0)
    start, direction = start[leaves], direction[leaves]
    first = np.argmin(stays[:, leaves], axis=0)  # the first step outside
    low, high = steps[np.maximum(first - 1, 0)], steps[first]
    for _ in range(20):
        middle = (low + high) / 2
        within = inside(start + middle[:, None] * direction)
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    return start + low[:, None] * direction


def measure(vertices, triangles, closed):
    """Returns (spacings, {method: errors of interpolation}, {method: errors of the represented volume}), in percent of size.

    errors: (k, 2), the largest and the mean for each spacing.
    """
    import tolvol_baselines as baselines

    rng = np.random.default_rng(SEED)
    size = tolvol.diagonal(vertices, triangles)
    tolerance = TOLERANCE * size
    coarse = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    points = surface_points(vertices, triangles, POINTS, rng)
    points += tolerance * rng.random((POINTS, 1)) * directions(POINTS, rng)
    exact = coarse.distance(points)
    start, direction = surface_points(vertices, triangles, RAYS, rng), directions(RAYS, rng)

    interpolated, offset = {name: [] for name in METHODS}, {name: [] for name in METHODS}

    def note(errors, name, values):
        errors[name].append((100 / size) * np.array([values.max(), values.mean()]))

    for precision in PRECISIONS:
        inside = {}
        for name, field in FIELDS.items():
            if field == "gl" and precision > FINEST_GL:
                continue
            volume = tolvol.ToleranceVolume(
                vertices, triangles, REACH * tolerance, precision=REACH * precision, field=field
            )
            at = interpolation(volume, closed)
            note(interpolated, name, np.abs(at(points) - exact))
            inside[name] = lambda p, at=at: at(p) <= tolerance
        inside["permission grid"] = baselines.PermissionGrid(vertices, triangles, tolerance, precision).permits
        for name, test in inside.items():
            left = first_exit(test, start, direction, 3 * tolerance)
            note(offset, name, np.abs(coarse.distance(left) - tolerance))
    errors = [{name: np.array(e[name]) for name in METHODS if e[name]} for e in (interpolated, offset)]
    return 100 * TOLERANCE / PRECISIONS, *errors


def draw(picture):
    """Measures everything and writes the picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, len(SHAPES), figsize=(12, 7.6), sharex=True, constrained_layout=True)
    for column, (shape, (fill, closed)) in enumerate(SHAPES.items()):
        spacing, *errors = measure(*new_mesh(fill), closed)
        for axis, by_method in zip(axes[:, column], errors):
            for name, values in by_method.items():
                colour, marker = METHODS[name]
                at = spacing[: len(values)]
                for k, (what, line) in enumerate((("max", "-"), ("mean", "--"))):
                    slope = np.polyfit(np.log(at), np.log(values[:, k]), 1)[0]
                    axis.loglog(
                        at,
                        values[:, k],
                        line,
                        color=colour,
                        marker=marker,
                        markersize=5,
                        markerfacecolor=colour if k == 0 else "white",
                        label=f"{name}, {what}: ~ $h^{{{slope:.1f}}}$",
                    )
            axis.grid(True, which="both", color="#DDDDDD", linewidth=0.6)
            low, high = axis.get_ylim()
            axis.set_ylim(low / (high / low) ** (0.3 * len(by_method)), high)  # room for the legend
            axis.legend(fontsize=8, loc="lower right", framealpha=1)
            axis.set_xticks(spacing, [f"{h:.2g}" for h in spacing])
            axis.minorticks_off()
        axes[0, column].set_title(shape if closed else f"{shape} (open: without signs)")
        axes[1, column].set_xlabel("spacing h, % of size")
    for axis, what in zip(
        axes[:, 0], ("trilinear interpolation\nagainst exact distance", "represented volume\nagainst tolerance")
    ):
        axis.set_ylabel(f"{what}, % of size")
    figure.suptitle(f"Error of distance fields against grid spacing, tolerance {100 * TOLERANCE:g} % of size")
    figure.savefig(picture, dpi=110)


def arguments():
    parser = cli.Parser(
        "docs/figures/error_plot.py", description="Draws error against grid spacing for three ways to hold a volume."
    )
    parser.add_argument("picture", metavar="PICTURE.png")
    return parser.parse()


def main(options):
    cli.require_folder(options.picture, "PICTURE")
    draw(options.picture)
    return 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)

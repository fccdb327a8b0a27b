# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws deviations with legends. tolvol renders the images, and matplotlib puts them on a white page."""

from pathlib import Path

import numpy as np

from .. import package
from ..proof import deviation_pictures
from .arguments import Stop, require_folder

DPI = 100  # A point of type is 100/72 pixels.
INK, FAINT = "#1b1e25", "#6a6f7a"
WIDTH, HEIGHT, LEGEND = 800, 700, 230  # pixels: width and height of the image of a mesh, and width of its legend
MARGIN = 20
EDGES_UP_TO = 5000  # triangles; the edges of a mesh with more triangles would hide the colours
STRIPE = 12  # pixels from one stripe to the next in the images that tolvol renders


def require(option, path):
    """Raises Stop before the work begins if the picture cannot be made or written."""
    require_folder(path, option)
    if Path(path).suffix.lower() != ".png":
        raise Stop(f"{option} {path}: the extension must be .png")
    if reason := unavailable():
        raise Stop(f"{option}: {reason}")


def unavailable():
    """Why no picture can be made here, or None."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        return f"{error}; install matplotlib (Debian: python3-matplotlib)"
    return deviation_pictures.unavailable()


def up_axis(path):
    """Returns the axis that is up by the convention of a file's format. The file does not say it."""
    return "Y" if Path(path).suffix.lower() in {".obj", ".gltf", ".glb"} else "Z"


def camera(vertices, triangles, size, path="", margin=0.0):
    """Returns a camera that shows a mesh upright, by the convention of the format of `path`."""
    view = deviation_pictures.VIEWS[up_axis(path)]
    return package.module.Camera.framing(vertices, triangles, size=size, margin=margin, **view)


class Page:
    """A white page. Positions are in pixels from its upper left corner."""

    def __init__(self, width, height):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.width, self.height = width, height
        self.figure = Figure((width / DPI, height / DPI), dpi=DPI, facecolor="white")
        FigureCanvasAgg(self.figure)

    def image(self, x, y, pixels):
        self.figure.figimage(pixels, x, self.height - y - pixels.shape[0])

    def text(self, x, y, text, size=10, colour=INK, **options):
        """Draws text. `y` is the top of its first line."""
        options = {"va": "top", **options}
        self.figure.text(x / self.width, 1 - y / self.height, text, size=size, color=colour, **options)

    def legend(self, x, y, height, transfer, tolerance, size, shares=None, lowest=None, outside=True):
        """Draws the colours with their lengths.

        tolerance, size: in the units of the mesh; lowest: the lowest distance of the bar, in tolerances; outside: whether to
        explain the stripes too; shares: the shares of the area within a quarter, half and all of the tolerance, which are
        printed below.
        """
        bar = height - 50 - 28 * outside - (116 if shares is not None else 0)
        colours, whole = package.module.transfer_colours(transfer), -1 if transfer == "signed" else 0
        lowest = whole if lowest is None else lowest
        axes = self.figure.add_axes((x / self.width, 1 - (y + bar) / self.height, 18 / self.width, bar / self.height))
        axes.imshow(colours[:, None], aspect="auto", origin="lower", extent=(0, 1, whole, 1))
        axes.set_ylim(lowest, 1)
        ticks = np.linspace(lowest, 1, 5)
        axes.set_yticks(ticks, [self._label(tick, tolerance) for tick in ticks], size=9, color=INK)
        axes.yaxis.tick_right()
        axes.set_xticks([])
        for spine in axes.spines.values():
            spine.set_edgecolor(FAINT)
        axes.tick_params(color=FAINT)
        y += bar + 22
        if outside:
            self.image(x, y, stripes(18, 18))
            self.text(x + 26, y + 1, "outside the tolerance", 9)
            y += 28
        self.text(x, y, f"ε = {tolerance:.3g} = {100 * tolerance / size:.3g} % of size", 9, FAINT)
        if shares is not None:
            within = [f"{100 * share:.1f} % within {part}ε" for part, share in zip(("¼ ", "½ ", ""), shares)]
            self.text(x, y + 30, "\n".join(["Of the area", *within, f"{self._percent(1 - shares[-1])} outside"]), 9)

    @staticmethod
    def _percent(share):
        """Returns a share as text. A share above 0 is never shown as 0.0 %."""
        return f"{100 * share:.1f} %" if share == 0 or share >= 0.0005 else "< 0.1 %"

    @staticmethod
    def _label(part, tolerance):
        name = {-1: "−ε", 0: "0", 1: "ε"}.get(part)
        length = f"{part * tolerance:.3g}".replace("-", "−")
        return f" {name} = {length}" if name and part else f" {name or length}"

    def save(self, path, step=1):
        """Saves the page. Of the 256 levels of each channel only every `step`-th is used.

        A step of 3 is not visible and makes the file a fifth smaller.
        """
        from PIL import Image

        self.figure.canvas.draw()
        levels = np.asarray(self.figure.canvas.buffer_rgba())[..., :3].astype(int)
        levels = np.where(levels == 255, 255, np.minimum((levels + step // 2) // step * step, 255))
        Image.fromarray(levels.astype(np.uint8)).save(path, format="PNG", optimize=True)


def stripes(width, height):
    """Returns an image of the stripes that tolvol draws beyond the tolerance."""
    y, x = np.mgrid[:height, :width]
    colours = np.array(package.module.OUTSIDE_COLOURS, np.uint8)
    return colours[((x - y) % STRIPE >= STRIPE / 2).astype(int)]


def shares_within(surface, reference, tolerance, threads=None):
    """Returns the shares of a surface's area within a quarter, half and all of the tolerance of another surface."""
    bounds = [tolerance / 4, tolerance / 2, tolerance]
    spread = package.module.deviation(*surface, *reference, bounds=bounds, threads=threads)
    return [1 - float(share) for share in spread.share_beyond]


def save_deviation(path, surface, reference, tolerance, size, like="", threads=None):
    """Saves a picture of a surface coloured by its distance to another. Both are (vertices, triangles) in the world.

    path: a path or a binary file; size: the length that is 100 %; like: the file of the surface, for the up axis.
    """
    # The tolerance of a volume is at most the size of its reference. Parts that are farther away are striped.
    tolerance = min(tolerance, package.module.diagonal(*reference))
    volume = package.module.ToleranceVolume(*reference, tolerance, threads=threads)
    view = camera(*surface, (WIDTH, HEIGHT), like)
    edges = len(surface[1]) <= EDGES_UP_TO
    pixels = package.module.render_distance(
        *surface, volume, camera=view, size=(WIDTH, HEIGHT), edges=edges, threads=threads
    )
    page = Page(WIDTH + LEGEND, HEIGHT)
    page.image(0, 0, pixels)
    shares = shares_within(surface, reference, tolerance, threads)
    page.text(WIDTH + MARGIN, MARGIN, f"{len(surface[1]):,} triangles", 12)
    page.text(WIDTH + MARGIN, MARGIN + 22, f"distance to the other surface,\n{len(reference[1]):,} triangles", 9, FAINT)
    page.legend(WIDTH + MARGIN, MARGIN + 70, HEIGHT - 2 * MARGIN - 70, "signed", tolerance, size, shares)
    page.save(path)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The options of a decimation."""

from ..decimation import FEWEST_LEVELS, MOST_LEVELS
from .arguments import above_zero, angle, file_name, length, several, whole_number

DESCRIPTION = """\
Reduces the triangles of the meshes of IN within the tolerance and writes the meshes to OUT. The written file is read back, and
proved to be within the tolerance, before it is moved to OUT."""

EPILOG = """\
The last line of the output gives the result. Its percentages are of the size of the reference (the longest diagonal of the
bounding box), and its time is the time of the whole command. Exit codes: 0 proved; 2 bad usage or input; 3 not proved; 1 a file
that could not be written, or a bug. Only with exit code 0 are OUT, its side files, the report and the picture written, all of
them or none. Symbolic links are followed. OUT may be IN. No other file that is read and no texture beside OUT is overwritten."""

_TOLERANCE = "N%% of size, or a length in the file's units"


def add_files(parser):
    """Adds IN and OUT and the files of one decimation to a parser."""
    parser.add_argument("input", type=file_name, metavar="IN", help="the mesh to decimate")
    parser.add_argument(
        "output", type=file_name, metavar="OUT", help="the file for the result; its extension chooses the format"
    )
    add_tolerance_or_levels(parser)
    add(parser)
    parser.add_argument("--report", type=file_name, metavar="FILE.json", help="write all numbers to this file")
    parser.add_argument(
        "--picture",
        type=file_name,
        metavar="FILE.png",
        help="draw the result to this file, coloured by its distance to the reference; needs OpenGL",
    )


def add_tolerance(parser):
    """Adds the option of a decimation to one tolerance, without levels of detail, to a parser."""
    parser.add_argument("--tolerance", type=length, required=True, metavar="T", help=_TOLERANCE)
    parser.set_defaults(lod=None, lod_pixels=None, distance=None, fov=None, height=None)


def add_tolerance_or_levels(parser):
    """Adds the options of a tolerance, or of levels of detail, to a parser."""
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("--tolerance", type=length, metavar="T", help=_TOLERANCE)
    levels = FEWEST_LEVELS, MOST_LEVELS
    asked.add_argument(
        "--lod",
        type=several(length, *levels),
        metavar="T,T,...",
        help="make a chain of levels of detail, one for each of 2 to 6 growing tolerances: OUT_LOD0, OUT_LOD1, ... with OUT's "
        "extension. Each is decimated from IN and proved both ways; in glTF, geometricError in the extras of a node is its "
        "deviation",
    )
    asked.add_argument(
        "--lod-pixels",
        type=several(above_zero, *levels),
        metavar="N,N,...",
        help="do the same, with as many pixels as the deviation of each level may cover in a picture from --distance",
    )
    parser.add_argument(
        "--distance",
        type=length,
        metavar="D",
        help="N%% of size, or a length in the file's units, for --lod-pixels",
    )
    parser.add_argument(
        "--fov",
        type=angle,
        metavar="A",
        help="the vertical angle of view in degrees, for --lod-pixels (default: 50)",
    )
    parser.add_argument(
        "--height",
        type=whole_number(1),
        metavar="N",
        help="the height of the picture in pixels, for --lod-pixels (default: 1080)",
    )


def add(parser):
    """Adds the other options that a decimation of one file and of many have in common to a parser."""
    parser.add_argument(
        "--reference",
        type=file_name,
        metavar="REF",
        help="a file that the tolerance refers to (default: IN itself)",
    )
    parser.add_argument(
        "--one-sided",
        action="store_true",
        help="keep only the result within the tolerance of the reference; parts of the reference may vanish",
    )
    parser.add_argument(
        "--placement",
        choices=("optimal", "subset"),
        help="optimal: fewest triangles; subset: every vertex is a vertex of IN (default: subset with UVs, else optimal)",
    )
    parser.add_argument(
        "--effort",
        choices=("fast", "thorough"),
        default="fast",
        help="thorough: a third fewer triangles in 5 to 25 times the processor time; a mesh of some hundred triangles may "
        "take 75 times as long, and 20 seconds (default: fast)",
    )
    parser.add_argument(
        "--crossings",
        choices=("keep_out", "allow"),
        default="keep_out",
        help="keep_out: no faces cross in the result that did not cross in IN; allow: they may, as the two sides of a thin "
        "wall do (default: keep_out)",
    )
    parser.add_argument(
        "--max-normal-angle",
        type=angle,
        default=90,
        metavar="A",
        help="the largest angle, in degrees from 1 to 180, between a face of the result and the faces of the reference that "
        "it stands for; 180 permits any angle (default: 90, which turns no face over)",
    )
    parser.add_argument(
        "--max-seconds",
        type=whole_number(1),
        metavar="S",
        help="stop after S seconds for each object with the result that is proved by then (default: no limit)",
    )
    parser.add_argument(
        "--target-triangles",
        type=whole_number(1),
        metavar="N",
        help="stop at N triangles if the tolerance permits so few; N is divided among objects by their triangles",
    )
    parser.add_argument(
        "--close-holes",
        action="store_true",
        help="first fill the holes that can be filled within the tolerance, such as the pinholes of a scan, and the ends of "
        "a tube thinner than the tolerance",
    )
    parser.add_argument(
        "--largest-perimeter",
        type=length,
        metavar="LENGTH",
        help="leave holes open whose rim is longer; N%% of size, or a length in the file's units (default: no limit)",
    )
    parser.add_argument(
        "--outside",
        choices=("error", "keep"),
        default="error",
        help="how to treat faces of IN that are not within the tolerance of the reference: stop with an error, or keep "
        "them as they are (default: error)",
    )
    parser.add_argument("--threads", type=whole_number(1), metavar="N", help="default: all cores")


def checked(parser, options):
    """Returns the options. Raises Stop if they make no sense together."""
    if options.largest_perimeter and not options.close_holes:
        parser.error("--largest-perimeter needs --close-holes")
    if options.lod_pixels and options.distance is None:
        parser.error("--lod-pixels needs --distance")
    for name in ("distance", "fov", "height"):
        if getattr(options, name) is not None and not options.lod_pixels:
            parser.error(f"--{name} needs --lod-pixels")
    if options.fov == 180:
        parser.error("--fov: an angle of view of 180 degrees has no picture")
    for name in ("one_sided", "target_triangles"):
        if getattr(options, name) and options.tolerance is None:
            parser.error(f"--{name.replace('_', '-')} cannot be used with levels of detail")
    return options

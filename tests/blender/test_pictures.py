# SPDX-License-Identifier: GPL-3.0-or-later
"""The option --picture of the commands, and the scripts of the figures."""

import base64
import re

import bpy
import numpy as np
import pytest

from addon import native
from commands import FIGURES, command, decimate, save, succeeded
from scenes import sheet_arrays

pytestmark = pytest.mark.usefixtures("gl")


def pixels(path):
    """(height, width, 4) uint8, top row first."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    values = np.empty(4 * width * height, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return np.rint(255 * values.reshape(height, width, 4)[::-1]).astype(np.uint8)


def marked(picture):
    """Returns the number of pixels in the image of the mesh that have the first colour of the stripes."""
    return int((picture[:, :800, :3] == np.array(native.module.OUTSIDE_COLOURS[0])).all(-1).sum())


def test_decimate_draws_its_result(scan, tmp_path):
    picture = tmp_path / "picture.png"
    succeeded(decimate(scan, tmp_path / "out.ply", "--tolerance", "1%", "--picture", picture, alone=True))
    drawn = pixels(picture)
    assert drawn.shape[1] > drawn.shape[0] > 400 and marked(drawn) == 0
    assert len(np.unique(drawn.reshape(-1, 4), axis=0)) > 1000


def test_report_draws_both_directions_into_its_page(tmp_path):
    scan = save(tmp_path / "scan.ply", ("scan", *sheet_arrays(count=20, bumps=0.2)))
    page, picture = tmp_path / "r.html", tmp_path / "picture.png"
    arguments = scan, tmp_path / "out.ply", "--tolerance", "1%"
    succeeded(decimate(*arguments))
    for tolerance, outside in (("1%", False), ("0.3%", True)):
        options = "--tolerance", tolerance, "--report", page, "--picture", picture
        assert command("report.py", tmp_path / "out.ply", scan, *options)[::2] == (0, "")
        images = re.findall(r'src="data:image/png;base64,([^"]+)"><figcaption>([^<]+)', page.read_text())
        assert [caption for _, caption in images] == [
            "out.ply, coloured by its distance from scan.ply",
            "scan.ply, coloured by its distance from out.ply",
        ]
        assert images[0][0] != images[1][0] and (marked(pixels(picture)) > 100) == outside
        in_page = tmp_path / "in_page.png"
        in_page.write_bytes(base64.b64decode(images[0][0]))
        assert (marked(pixels(in_page)) > 100) == outside
    code, _, error = command("report.py", scan, scan, "--picture", tmp_path / "a.jpg")
    assert code == 2 and ".png" in error


def test_a_picture_needs_a_folder_and_a_png(scan, tmp_path):
    for name, said in (("nowhere/a.png", "does not exist"), ("a.jpg", ".png")):
        code, _, error = decimate(scan, tmp_path / "out.ply", "--tolerance", "1%", "--picture", tmp_path / name)
        assert code == 2 and said in error
    assert not (tmp_path / "out.ply").exists()


def test_figures_are_drawn_of_any_mesh(scan, tmp_path):
    assert command(FIGURES / "figures.py", scan, "--output", tmp_path, "--tolerance", "2%")[::2] == (0, "")
    volume, distance = pixels(tmp_path / "volume.png"), pixels(tmp_path / "distance.png")
    for picture in (volume, distance):
        assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 1000
    code, _, error = command(FIGURES / "figures.py", scan, "--output", tmp_path / "nowhere")
    assert code == 2 and "does not exist" in error

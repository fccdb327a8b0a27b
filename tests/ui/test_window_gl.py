# SPDX-License-Identifier: GPL-3.0-or-later
"""GL of the module beside Blender's window, which has a context of its own."""

import numpy as np

import addon
import scenes
from addon import native
from test_panel import monkey, suzanne
from window import reset, screenshot, view


def test_pictures_and_queries_leave_the_window_alone():
    yield from reset(monkey)
    surface = scenes.world_triangles(suzanne())
    volume = native.module.ToleranceVolume(*surface, 0.05, precision=4)
    first = native.module.render_distance(*surface, volume, size=(60, 40))
    for _ in range(3):
        view()[1].tag_redraw()
        yield
        assert np.array_equal(native.module.render_distance(*surface, volume, size=(60, 40)), first)
        assert (volume.check(*surface, method="occlusion_query").verdicts == 2).all()
    screenshot("gl 1 window beside pictures")
    addon.unregister()
    yield
    addon.register()
    yield
    volume = native.module.ToleranceVolume(*surface, 0.05)
    picture = native.module.render_volume(volume, size=(60, 40))
    assert 0.2 < (picture[..., 3] > 0).mean() < 1
    screenshot("gl 2 registered again")

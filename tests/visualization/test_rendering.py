"""Images of one mesh over another are those of both together, and nothing is left behind."""

import numpy as np

from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.rendering import render, render_over

SIZE = (160, 120)


def test_images_over_a_base_are_those_of_both_meshes_as_one():
    grid = np.stack(np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 20), [0.0]), axis=-1)
    base = ColoredMesh()
    base.add_points(grid, radius=0.02)
    balls, expected = [], []
    for x, color in ((0.2, (1, 0, 0)), (0.8, (0, 0, 1))):
        ball, both = ColoredMesh(), ColoredMesh()
        both.add_points(grid, radius=0.02)
        for mesh in (ball, both):
            mesh.add_sphere([x, 0.5, 0.3], color=color, radius=0.1)
        balls.append(ball)
        expected.append(render(both, size=SIZE))
    images = render_over(base, [*balls, ColoredMesh()], size=SIZE)
    assert np.array_equal(images[0], expected[0])
    assert np.array_equal(images[1], expected[1])
    assert np.array_equal(images[2], render(base, size=SIZE))
    red = [int(((image[..., 0] > 150) & (image[..., 1] < 100)).sum()) for image in images]
    assert red[0] > 100
    assert red[1:] == [0, 0]


def test_given_bounds_are_those_of_every_image():
    base, ball = ColoredMesh(), ColoredMesh()
    base.add_sphere([0.0, 0.0, 0.0], radius=0.1)
    ball.add_sphere([5.0, 0.0, 0.0], radius=0.1)
    bounds = ([-0.2] * 3, [0.2] * 3)
    with_ball, without = render_over(base, [ball, ColoredMesh()], size=SIZE, bounds=bounds)
    assert np.array_equal(with_ball, without)

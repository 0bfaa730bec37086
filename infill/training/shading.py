"""Colours from coverage and N.V, with the light at the viewer as in the crate `wavefront`."""

from typing import NamedTuple

import torch


class Shading(NamedTuple):
    base_color: tuple
    ambient: float
    diffuse: float
    specular: float
    shininess: float


# The crate's default, and the published renderer's, for whose colours its network was trained.
DEFAULT = Shading((0.85, 0.76, 0.68), 0.15, 0.75, 0.2, 30.0)
PUBLISHED = Shading((0.3, 0.3, 0.9), 0.2, 0.6, 0.1, 5.0)
BACKGROUND = (1.0, 1.0, 1.0)
# What the published network is shown at unfinished pixels.
UNFINISHED = (1.0, 0.0, 0.0)
# Rec. 601.
LUMA = (0.299, 0.587, 0.114)


def picture(coverage, facing, shading=DEFAULT):
    """Display-referred colours [n, 3, h, w]."""
    column = lambda c: torch.tensor(c, dtype=facing.dtype, device=facing.device).view(1, 3, 1, 1)
    facing = facing.unsqueeze(1)
    highlight = shading.specular * facing.clamp(min=1e-6) ** shading.shininess
    surface = column(shading.base_color) * (shading.ambient + shading.diffuse * facing) + highlight
    coverage = coverage.unsqueeze(1)
    return column(BACKGROUND) * (1 - coverage) + surface * coverage


def luma(color):
    r, g, b = color.unbind(dim=1)
    return (LUMA[0] * r + LUMA[1] * g + LUMA[2] * b).unsqueeze(1)

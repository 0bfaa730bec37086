"""Colours from coverage and N.V: the default `Shading` of the crate `wavefront`, with the light at the viewer."""

import torch

BASE_COLOR = [0.85, 0.76, 0.68]
AMBIENT = 0.15
DIFFUSE = 0.75
SPECULAR = 0.2
SHININESS = 30.0
BACKGROUND = [1.0, 1.0, 1.0]
# What the published network is shown at unfinished pixels.
UNFINISHED = [1.0, 0.0, 0.0]
# Rec. 601.
LUMA = [0.299, 0.587, 0.114]


def picture(coverage, facing):
    """Display-referred colours [n, 3, h, w]."""
    column = lambda c: torch.tensor(c, dtype=facing.dtype, device=facing.device).view(1, 3, 1, 1)
    facing = facing.unsqueeze(1)
    highlight = SPECULAR * facing.clamp(min=1e-6) ** SHININESS
    surface = column(BASE_COLOR) * (AMBIENT + DIFFUSE * facing) + highlight
    coverage = coverage.unsqueeze(1)
    return column(BACKGROUND) * (1 - coverage) + surface * coverage


def luma(color):
    r, g, b = color.unbind(dim=1)
    return (LUMA[0] * r + LUMA[1] * g + LUMA[2] * b).unsqueeze(1)

"""Metrics of pictures in 0..1, as the crate `gpu-testkit` defines them."""

import functools
import math

import torch

RADIUS = 5
SIGMA = 1.5
STABILISERS = (0.01**2, 0.03**2)


@functools.lru_cache
def blur_matrix(size):
    """Every row the weights of one pixel's window on one axis: a Gaussian cut off at the edges, with a sum of 1."""
    offsets = torch.arange(size).view(1, -1) - torch.arange(size).view(-1, 1)
    weights = torch.exp(-0.5 * (offsets / SIGMA) ** 2) * (offsets.abs() <= RADIUS)
    return weights / weights.sum(dim=1, keepdim=True)


def blurred(x):
    """Means of windows of 11x11 pixels; by products, whose gradients cost less than those of convolutions."""
    rows, columns = (blur_matrix(size).to(x) for size in x.shape[2:])
    return rows @ x @ columns.T


def ssim(a, b):
    """Mean structural similarity of grey pictures [n, 1, h, w], one number per picture."""
    mean_a, mean_b, aa, bb, ab = blurred(torch.cat([a, b, a * a, b * b, a * b])).chunk(5)
    c1, c2 = STABILISERS
    means = (2 * mean_a * mean_b + c1) / (mean_a**2 + mean_b**2 + c1)
    variances = aa - mean_a**2 + bb - mean_b**2
    return (means * (2 * (ab - mean_a * mean_b) + c2) / (variances + c2)).mean(dim=(1, 2, 3))


def psnr_of(mean_square):
    return 10 * math.log10(1 / mean_square) if mean_square > 0 else math.inf


def psnr(a, b, mask=None):
    """Peak signal-to-noise ratio in dB of colours [3, h, w]; of the pixels of a mask [h, w] only, if there is one."""
    error = (a - b).square()
    if mask is not None:
        error = error[:, mask]
    return psnr_of(error.mean().item())


def tpsnr(a, b, a_before, b_before):
    """PSNR of the change from the previous frame: low where a picture flickers."""
    return psnr_of(((a - a_before) - (b - b_before)).square().mean().item())


def iou(coverage, truth, mask):
    """Intersection over union of the surface's pixels among those of a mask; NaN where there is no surface."""
    a, b = (coverage[mask] >= 0.5), (truth[mask] >= 0.5)
    union = (a | b).sum().item()
    return (a & b).sum().item() / union if union else math.nan

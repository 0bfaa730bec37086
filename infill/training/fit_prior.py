"""Fits the shares of the classical filler, `infill::PRIOR` and `infill::DOUBT`, on the training frames.

    python fit_prior.py TRAINING_FOLDER

Prints the fitted shares and, for these, those of network.py and some others, the mean PSNR of the holes' colours over the frames of
every kind of volume. Every fifth frame is used; in each, 1500 holes for the fit.
"""

import argparse
from pathlib import Path

import numpy as np
import torch

import data
import metrics
import network
import shading

STRIDE, HOLES, STEPS = 5, 1500, 500
# Neighbours, coarse field, thin, history, and the doubt of neighbours that disagree.
SHARES = {
    "neighbours alone": [0, -99, -99, -99, 0],
    "coarse field alone": [-99, 0, -99, -99, 0],
    "1 : 1 : 1/4 : 3": [0.0, 0.0, -1.4, 1.1, 0],
    "committed": network.PRIOR + [network.DOUBT],
}


def holes(folder):
    """Kind and the channels [n] of the holes of every fifth frame."""
    for record in data.records(folder)[::STRIDE]:
        frame = data.as_frame(data.load(Path(folder) / record["file"])[None])
        hole = frame["finished"] == 0
        if hole.sum() >= HOLES // 5:
            yield record["volume"], {name: values[hole] for name, values in frame.items()}


def error(frame, shares):
    """Mean squared error of the holes' colours."""
    stacked = lambda name: torch.stack([frame[f"{name}_{s}"] for s in network.SOURCES])
    valid, coverage, facing = stacked("v"), stacked("c"), stacked("nv")
    doubt = shares[4] * 4 * frame["c_P"] * (1 - frame["c_P"])
    logits = shares[:4].view(4, 1) - torch.stack([doubt, *[torch.zeros_like(doubt)] * 3])
    covered = torch.softmax(logits.masked_fill(valid == 0, -1e9), dim=0) * valid * coverage
    total = covered.sum(dim=0)
    mean = torch.where(total > 0, (covered * facing).sum(dim=0) / total.clamp(min=1e-12), torch.full_like(total, 0.5))
    row = lambda x: x.clamp(0, 1).view(1, 1, -1)
    shown = shading.picture(row(total), row(mean), shading.PUBLISHED)
    truth = shading.picture(row(frame["truth_c"]), row(frame["truth_nv"]), shading.PUBLISHED)
    return (shown - truth).square().mean()


def fit(frames):
    """The shares with the best mean PSNR of some holes of every frame; that of the coarse field stays 0."""
    generator = torch.Generator().manual_seed(0)
    pick = lambda n: torch.randperm(n, generator=generator)[:HOLES]
    some = [{k: v[i] for k, v in f.items()} for _, f in frames for i in [pick(len(f["c"]))]]
    free = torch.tensor([1.0, 0, 1, 1, 1])
    shares = torch.tensor(SHARES["1 : 1 : 1/4 : 3"]).requires_grad_()
    optimiser = torch.optim.Adam([shares], lr=0.05)
    for _ in range(STEPS):
        loss = torch.stack([error(frame, shares * free).log() for frame in some]).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    return (shares * free).detach().tolist()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("training")
    folder = parser.parse_args().training
    data.check_split(folder, "training")
    frames = list(holes(folder))
    fitted = fit(frames)
    print("fitted", [round(x, 2) for x in fitted])
    kinds = sorted({kind for kind, _ in frames})
    print("| shares | " + " | ".join(kinds) + " | mean |\n| --- |" + " ---: |" * (len(kinds) + 1))
    for name, shares in {**SHARES, "fitted": fitted}.items():
        psnr = lambda frame: metrics.psnr_of(error(frame, torch.tensor(shares, dtype=torch.float32)).item())
        means = [np.mean([psnr(frame) for k, frame in frames if k == kind]) for kind in kinds]
        print(f"| {name} | " + " | ".join(f"{x:.1f}" for x in means) + f" | {np.mean(means):.2f} |")


if __name__ == "__main__":
    main()

"""Trains the network on frames of `infill-dataset`.

    python train.py TRAINING_FOLDER VALIDATION_FOLDER --out ../weights/infill.safetensors --curve curve.json
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file

import data
import metrics
import shading
from network import DOUBT, Network, PRIOR, mix, shown

CROP = 128
# Places tried per crop; the one is taken with a chance that grows with its holes.
TRIES = 4
# A crop without this share of holes teaches nothing.
LEAST_HOLES = 0.01
# Chances that a picture lacks a source, so that each can be left out.
DROP = {"P": 0.05, "LX": 0.1, "R": 0.25}
# A wrong N.V shows more in the first, a surface where there is none in the second.
COLORS = [shading.DEFAULT, shading.PUBLISHED]
LEARNING_RATE = 3e-3
SSIM_WEIGHT = 0.5
# Shares and doubt from which training starts.
START = [0.0, 0.0, -1.4, 1.1, 0.0]
# Pulls what the residuals push beyond 0..1 back, where clamping has no gradient.
EXCESS_WEIGHT = 0.1


def load_split(folder, split):
    data.check_split(folder, split)
    return [data.load(Path(folder) / r["file"]) for r in data.records(folder)]


def random_crop(frames, rng):
    """A crop of some frame, chosen by hole density, flipped and transposed at random."""
    while True:
        crops = []
        for _ in range(TRIES):
            frame = frames[rng.integers(len(frames))]
            # Quads stay together.
            y, x = (2 * rng.integers((size - CROP) // 2 + 1) for size in frame.shape[1:])
            crops.append(frame[:, y : y + CROP, x : x + CROP])
        holes = np.array([(crop[0] == 0).mean() for crop in crops])
        if holes.max() >= LEAST_HOLES:
            break
    crop = crops[rng.choice(TRIES, p=holes / holes.sum())]
    if rng.random() < 0.5:
        crop = crop[:, :, ::-1]
    if rng.random() < 0.5:
        crop = crop[:, ::-1]
    if rng.random() < 0.5:
        crop = crop.transpose(0, 2, 1)
    return np.ascontiguousarray(crop)


def drop_sources(frame, rng):
    """The batch with random sources left out of each picture, but never all of them."""
    count = len(frame["c"])
    dropped = {sources: rng.random(count) < chance for sources, chance in DROP.items()}
    dropped["P"] &= ~dropped["LX"]
    for sources, which in dropped.items():
        frame = data.without(frame, sources, torch.from_numpy(which.astype(np.float32)))
    return frame


def loss_of(network, frame, colors, start):
    raw = mix(frame, network(frame), start[4] - DOUBT, start[:4])
    coverage, facing = shown(frame, *raw)
    picture = shading.picture(coverage, facing, colors)
    truth = shading.picture(frame["truth_c"], frame["truth_nv"], colors)
    holes = (frame["finished"] == 0).unsqueeze(1).float()
    count = holes.sum().clamp(min=1)
    error = (picture - truth) * holes
    color = (error.abs().sum() + error.square().sum()) / (3 * count)
    similarity = metrics.ssim(shading.luma(picture), shading.luma(truth)).mean()
    excess = sum(((x - x.clamp(0, 1)).unsqueeze(1).abs() * holes).sum() for x in raw) / count
    mean_square = error.square().sum() / (3 * count)
    loss = color + SSIM_WEIGHT * (1 - similarity) + EXCESS_WEIGHT * excess
    return loss, mean_square


def validate(network, batches, start):
    """Mean loss and holes-only PSNR over fixed crops."""
    with torch.no_grad():
        results = [loss_of(network, data.as_frame(batch), colors, start) for batch in batches for colors in COLORS]
    loss, mean_square = (torch.stack(column).mean().item() for column in zip(*results))
    return loss, metrics.psnr_of(mean_square)


def save_weights(network, path, precision):
    values = network.state_dict().items()
    save_file({name: value.detach().to(precision).contiguous() for name, value in values}, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("training")
    parser.add_argument("validation")
    parser.add_argument("--out", required=True)
    parser.add_argument("--curve", required=True)
    parser.add_argument("--full", help="the same weights in full precision, to compare")
    parser.add_argument("--steps", type=int, default=12_000)
    parser.add_argument("--batch", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", type=float, nargs=5, default=START, help="shares of neighbours, coarse field, thin, history; doubt")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--validate-every", type=int, default=500)
    arguments = parser.parse_args()

    torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    rng = np.random.default_rng(arguments.seed)
    frames = load_split(arguments.training, "training")
    held = load_split(arguments.validation, "validation")
    fixed = np.random.default_rng(0)
    validation = [np.stack([random_crop(held, fixed) for _ in range(8)]) for _ in range(8)]

    network = Network().to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(network.parameters(), lr=LEARNING_RATE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, arguments.steps)
    curve, losses, start = [], [], time.monotonic()
    for step in range(arguments.steps + 1):
        if step % arguments.validate_every == 0 or step == arguments.steps:
            loss, psnr = validate(network, validation, arguments.start)
            mean = float(np.mean(losses)) if losses else None
            curve.append({"step": step, "training_loss": mean, "validation_loss": loss, "validation_psnr_holes": psnr})
            print(f"{step:6} {time.monotonic() - start:6.0f} s  training {mean}  validation {loss:.4f}  {psnr:.2f} dB", flush=True)
            losses = []
        if step == arguments.steps:
            break
        batch = np.stack([random_crop(frames, rng) for _ in range(arguments.batch)])
        colors = COLORS[rng.integers(len(COLORS))]
        loss, _ = loss_of(network, drop_sources(data.as_frame(batch), rng), colors, arguments.start)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        losses.append(loss.item())
    with torch.no_grad():
        # What the file has is added to PRIOR and DOUBT.
        network.head.bias[:4] += torch.tensor(arguments.start[:4]) - torch.tensor(PRIOR)
        network.doubt.fill_(arguments.start[4] - DOUBT)
    save_weights(network, arguments.out, torch.float16)
    if arguments.full:
        save_weights(network, arguments.full, torch.float32)
    recipe = {k: v for k, v in vars(arguments).items() if k in ("steps", "batch", "seed", "start")}
    recipe |= {"frames": len(frames), "seconds": round(time.monotonic() - start), "threads": arguments.threads}
    Path(arguments.curve).write_text(json.dumps({"recipe": recipe, "curve": curve}, indent=1) + "\n")


if __name__ == "__main__":
    main()

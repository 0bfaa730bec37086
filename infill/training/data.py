"""Frames as the example `infill-dataset` writes them: half-float EXR images and dataset.json.

dataset.json lists them: file, volume, sequence, frame, cut and more of every image.
"""

import json
from pathlib import Path

import numpy as np
import OpenEXR
import torch

CHANNELS = (
    "finished c nv c_P nv_P c_L nv_L c_X nv_X v_R c_R nv_R d_L d_X d_P d_R truth_c truth_nv".split()
)


def records(folder):
    """What dataset.json says about every frame, sequences one after the other."""
    frames = json.loads((Path(folder) / "dataset.json").read_text())
    return sorted(frames, key=lambda r: (r["sequence"], r["frame"]))


def check_split(folder, split):
    """Refuses a folder with other kinds of volumes than splits.json names."""
    allowed = json.loads((Path(__file__).parent / "splits.json").read_text())[split]["kinds"]
    others = {r["volume"] for r in records(folder)} - set(allowed)
    if others:
        raise SystemExit(f"{folder}: {sorted(others)} do not belong to the split {split!r}")


def load(path):
    """The channels [18, h, w] of an image in half precision."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return np.stack([channels[name].pixels for name in CHANNELS]).astype(np.float16)


def as_frame(values):
    """Named channels [n, h, w] of a batch [n, 18, h, w]."""
    values = torch.as_tensor(values).float()
    frame = dict(zip(CHANNELS, values.unbind(dim=1)))
    for source in "PLX":
        frame[f"v_{source}"] = torch.ones_like(frame["c"])
    return frame


def without(frame, sources, which=None):
    """The frame without some candidates, in all pictures of the batch or in those of a mask [n]."""
    frame = dict(frame)
    for source in sources:
        valid = frame[f"v_{source}"]
        frame[f"v_{source}"] = torch.zeros_like(valid) if which is None else valid * (1 - which.view(-1, 1, 1))
    return frame

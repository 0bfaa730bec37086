"""What the precision of the weights does to the holes of the held-out frames.

    python precision.py HELD_OUT_FOLDER FULL.safetensors --out precision.json

FULL.safetensors has the weights that `train.py --full` keeps. f16 is how the crate stores them; int8 has a scale for
each output channel and biases in f16.
"""

import argparse
import json
from collections import defaultdict
from pathlib import Path

import torch
from safetensors.torch import load_file

import data
import metrics
import shading
from evaluate import cut_group, means
from network import Network, mix, shown


def int8(name, value):
    """Rounded to 127 steps on either side of 0 per output channel."""
    if not name.endswith("weight"):
        return value.half().float()
    step = value.abs().amax(dim=(1, 2, 3), keepdim=True).clamp(min=1e-12) / 127
    return (value / step).round() * step


PRECISIONS = {
    "f32": lambda name, value: value,
    "f16": lambda name, value: value.half().float(),
    "int8": int8,
}


def networks(path):
    full = load_file(path)
    found = {}
    for precision, rounded in PRECISIONS.items():
        network = Network()
        network.load_state_dict({name: rounded(name, value.float()) for name, value in full.items()})
        found[precision] = network.eval()
    return found


def evaluate(folder, path):
    data.check_split(folder, "held-out")
    of, rows = networks(path), defaultdict(list)
    for record in data.records(folder):
        frame = data.as_frame(data.load(Path(folder) / record["file"])[None])
        holes = frame["finished"][0] == 0
        truth = shading.picture(frame["truth_c"], frame["truth_nv"], shading.PUBLISHED)
        for precision, network in of.items():
            filled = shown(frame, *mix(frame, network(frame), network.doubt))
            picture = shading.picture(*filled, shading.PUBLISHED).clamp(0, 1)
            row = {"psnr": metrics.psnr(picture[0], truth[0]), "psnr_holes": metrics.psnr(picture[0], truth[0], holes)}
            rows[precision, record["volume"], cut_group(record)].append(row)
    return [{"precision": p, "kind": kind, "cut": cut, **means(found)} for (p, kind, cut), found in rows.items()]


def table(rows):
    """Means over the kinds."""
    lines = ["| cut | weights | PSNR | PSNR of the holes |", "| --- | --- | ---: | ---: |"]
    for cut in sorted({row["cut"] for row in rows}):
        for precision in PRECISIONS:
            over = means([row for row in rows if row["cut"] == cut and row["precision"] == precision])
            lines.append(f"| {cut} | {precision} | {over['psnr']:.2f} | {over['psnr_holes']:.3f} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset")
    parser.add_argument("weights")
    parser.add_argument("--out")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    with torch.no_grad():
        rows = evaluate(arguments.dataset, arguments.weights)
    print(table(rows))
    if arguments.out:
        Path(arguments.out).write_text(json.dumps({"rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()

"""Makes every table of the held-out frames of a data set, for the committed weights.

    python evaluate.py HELD_OUT_FOLDER --out evaluation.json [--published WEIGHTS.safetensors] [--flip]
    python evaluate.py HELD_OUT_FOLDER --check evaluation.json

Pictures have the colours of the published renderer, for which its network was trained. --published takes the published weights (convert_published.py) and adds their rows; --flip needs flip-evaluator. With
--check nothing is written: figures that differ from those of the file by more than 0.02 (dB; or 0.0005 of another
measure) are named, and the exit code is 1.
"""

import argparse
import json
import math
import sys
from collections import defaultdict
from pathlib import Path

import torch
from safetensors.torch import load_file

import data
import metrics
import shading
from network import Network, OUTPUTS, mix, shown
from published_network import PublishedNetwork

WEIGHTS = Path(__file__).parent.parent / "weights"
MEASURES = ["psnr", "ssim", "psnr_holes", "iou_holes", "tpsnr", "flip"]
TOLERANCES = {"psnr": 0.02, "psnr_holes": 0.02, "tpsnr": 0.02}
OTHER_TOLERANCE = 5e-4
# Frames are cut at random shares of their pixels: percentages that bound the groups.
CUTS = [80, 87, 93, 98]
# Foveated frames have random densities far from the gaze: percentages that bound the groups.
DENSITIES = [1, 2, 5, 10]


class Mixture:
    """The candidates as the classical filler or a network mixes them, without those in `left_out`."""

    def __init__(self, network=None, left_out=""):
        self.network, self.left_out = network, left_out

    def start(self, frame):
        pass

    def __call__(self, frame):
        frame = data.without(frame, self.left_out)
        if self.network:
            outputs, doubt = self.network(frame), self.network.doubt
        else:
            outputs, doubt = torch.zeros(1, OUTPUTS, *frame["c"].shape[1:]), 0.0
        coverage, facing = shown(frame, *mix(frame, outputs, doubt))
        return shading.picture(coverage, facing, shading.PUBLISHED), coverage


class Unfinished:
    """What the published network is shown."""

    def start(self, frame):
        pass

    def __call__(self, frame):
        picture = shading.picture(frame["c"], frame["nv"], shading.PUBLISHED)
        red = torch.tensor(shading.UNFINISHED).view(1, 3, 1, 1)
        return torch.where(frame["finished"].unsqueeze(1) > 0, picture, red), frame["c"]


class Published:
    """The published network, frame after frame; its state is cleared at a sequence's start."""

    def __init__(self, path):
        self.network = PublishedNetwork()
        self.network.load_state_dict(load_file(path))

    def start(self, frame):
        self.state = self.network.initial_state(*frame["c"].shape[1:])

    def __call__(self, frame):
        picture, self.state = self.network(Unfinished()(frame)[0], self.state)
        return picture, None


def trained(name):
    network = Network()
    weights = load_file(WEIGHTS / f"{name}.safetensors")
    network.load_state_dict({name: value.float() for name, value in weights.items()})
    return network.eval()


def methods(published, sparse):
    """The ways to fill; with the network for sparse masks, if the frames are foveated."""
    network = trained("infill")
    found = {
        "unfinished": Unfinished(),
        "push-pull": Mixture(left_out="LXR"),
        "coarse": Mixture(left_out="PXR"),
        "coarse-thin": Mixture(left_out="PLR"),
        "classical": Mixture(),
        "network": Mixture(network),
        "network-no-history": Mixture(network, left_out="R"),
    }
    if sparse:
        found["network-sparse"] = Mixture(trained("sparse"))
    if published:
        found["published"] = Published(published)
    return found


def flip_of(picture, truth):
    import flip_evaluator

    to_array = lambda x: x.permute(1, 2, 0).contiguous().numpy()
    _, mean, _ = flip_evaluator.evaluate(to_array(truth), to_array(picture), "LDR", inputsRGB=True, applyMagma=False)
    return mean


def measured(frame, result, truth, before, with_flip):
    """Measures of one picture; those that it does not have are absent."""
    picture, coverage = result
    picture = picture.clamp(0, 1)
    holes = frame["finished"][0] == 0
    row = {
        "psnr": metrics.psnr(picture[0], truth[0]),
        "ssim": metrics.ssim(shading.luma(picture), shading.luma(truth)).item(),
    }
    if holes.any():
        row["psnr_holes"] = metrics.psnr(picture[0], truth[0], holes)
        if coverage is not None:
            row["iou_holes"] = metrics.iou(coverage[0], frame["truth_c"][0], holes)
    if before:
        row["tpsnr"] = metrics.tpsnr(picture[0], truth[0], *(x[0] for x in before))
    if with_flip:
        row["flip"] = flip_of(picture[0], truth[0])
    return {name: value for name, value in row.items() if math.isfinite(value)}, (picture, truth)


def cut_group(record):
    if "base_density" in record:
        share, bounds, name = record["base_density"], DENSITIES, "density {}-{} %"
    else:
        share, bounds, name = record["cut"], CUTS, "{}-{} %"
    return next(name.format(*ends) for ends in zip(bounds, bounds[1:]) if 100 * share <= ends[1] + 1e-4)


def evaluate(folder, published, with_flip):
    """Mean measures by method, kind and cut."""
    data.check_split(folder, "held-out")
    of = methods(published, any("base_density" in record for record in data.records(folder)))
    rows, previous, before = defaultdict(list), None, {}
    for record in data.records(folder):
        frame = data.as_frame(data.load(Path(folder) / record["file"])[None])
        # A new sequence, or a new isovalue within one: whatever looks back starts anew.
        sequence = (record["sequence"], record["isovalue"])
        if sequence != previous:
            previous, before = sequence, {}
            for method in of.values():
                method.start(frame)
        truth = shading.picture(frame["truth_c"], frame["truth_nv"], shading.PUBLISHED)
        for name, method in of.items():
            row, before[name] = measured(frame, method(frame), truth, before.get(name), with_flip)
            rows[name, record["volume"], cut_group(record)].append(row)
    return [
        {"method": method, "kind": kind, "cut": cut, "frames": len(found), **means(found)}
        for (method, kind, cut), found in rows.items()
    ]


def means(rows):
    mean = lambda values: round(sum(values) / len(values), 4)
    columns = {name: [row[name] for row in rows if name in row] for name in MEASURES}
    return {name: mean(values) for name, values in columns.items() if values}


def table(rows):
    """A Markdown table per cut: means over kinds, then the holes of every kind."""
    lines = []
    for cut in sorted({row["cut"] for row in rows}):
        kinds = sorted({row["kind"] for row in rows if row["cut"] == cut})
        lines += [cut if "density" in cut else f"cut at {cut} of the pixels", "", "| method | " + " | ".join(MEASURES + kinds) + " |"]
        lines.append("| --- |" + " ---: |" * (len(MEASURES) + len(kinds)))
        for method in dict.fromkeys(row["method"] for row in rows):
            own = [row for row in rows if row["method"] == method and row["cut"] == cut]
            over_kinds = means(own)
            cells = [over_kinds.get(name, "") for name in MEASURES]
            cells += [row.get("psnr_holes", "") for kind in kinds for row in own if row["kind"] == kind]
            lines.append(f"| {method} | " + " | ".join(map(str, cells)) + " |")
        lines.append("")
    return "\n".join(lines)


def differences(found, committed):
    """What of the committed figures was not found again."""
    key = lambda row: (row["method"], row["kind"], row["cut"])
    by_key = {key(row): row for row in found}
    for row in committed:
        again = by_key.get(key(row))
        for name in MEASURES:
            if again is None:
                yield f"{key(row)}: missing"
                break
            if name in row and name in again:
                tolerance = TOLERANCES.get(name, OTHER_TOLERANCE)
                if abs(again[name] - row[name]) > tolerance:
                    yield f"{key(row)}: {name} {again[name]} instead of {row[name]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset")
    parser.add_argument("--out")
    parser.add_argument("--check")
    parser.add_argument("--published")
    parser.add_argument("--flip", action="store_true")
    parser.add_argument("--threads", type=int, default=1)
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    with torch.no_grad():
        rows = evaluate(arguments.dataset, arguments.published, arguments.flip)
    print(table(rows))
    if arguments.out:
        Path(arguments.out).write_text(json.dumps({"rows": rows}, indent=1) + "\n")
    if arguments.check:
        committed = json.loads(Path(arguments.check).read_text())["rows"]
        without_published = [r for r in committed if arguments.published or r["method"] != "published"]
        problems = list(differences(rows, without_published))
        print("\n".join(problems) or f"all {len(without_published)} rows are those of {arguments.check}")
        sys.exit(bool(problems))


if __name__ == "__main__":
    main()

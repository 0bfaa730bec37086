"""Draws the curve that train.py writes.

    python plot_curve.py curve.json curve.svg
"""

import json
import sys

import matplotlib

matplotlib.use("svg")
matplotlib.rcParams["svg.hashsalt"] = "curve"
import matplotlib.pyplot as plt


def main():
    source, target = sys.argv[1:]
    with open(source) as file:
        points = json.load(file)["curve"]
    column = lambda name: ([p["step"] for p in points if p[name] is not None], [p[name] for p in points if p[name] is not None])
    figure, left = plt.subplots(figsize=(7, 4))
    left.plot(*column("training_loss"), label="training loss (mean since the last point)")
    left.plot(*column("validation_loss"), label="validation loss")
    left.set_xlabel("step")
    left.set_ylabel("loss")
    right = left.twinx()
    right.plot(*column("validation_psnr_holes"), color="tab:green", label="validation PSNR of holes")
    right.set_ylabel("dB")
    figure.legend(loc="center right", bbox_to_anchor=(0.9, 0.5))
    figure.tight_layout()
    figure.savefig(target, metadata={"Date": None})


if __name__ == "__main__":
    main()

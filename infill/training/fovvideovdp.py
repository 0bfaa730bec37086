"""FovVideoVDP of the films that the example `foveation --films` writes.

    python fovvideovdp.py FOLDER [--out fovvideovdp.json]

Just-objectionable differences, 10 for equal films (R. Mantiuk et al., FovVideoVDP, 2021): foveated, with the gaze of every
frame, on a display of 24 inches with 1920x1080 pixels at 0.6 m (`standard_fhd`), at 30 frames a second. Needs pyfvvdp 1.2.2
with scipy below 1.12.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import pyfvvdp
from PIL import Image  # comes with imageio

FRAMES_PER_SECOND = 30
DISPLAY = "standard_fhd"


def film(folder, row, method):
    """Frames [h, w, 3, n] of bytes."""
    name = f"{row['volume']}-{density(row)}-{method}"
    pictures = [Image.open(folder / f"{name}-{i:02}.png") for i in range(row["frames"])]
    return np.stack([np.asarray(picture.convert("RGB")) for picture in pictures], axis=3)


def density(row):
    """As the pictures' names have it."""
    return f"{np.float32(row['base_density']):g}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    rows = json.loads((arguments.folder / "foveation.json").read_text())["quality"]
    metric = pyfvvdp.fvvdp(display_name=DISPLAY, foveated=True, heatmap=None)
    found = []
    for row in rows:
        gaze = np.array(row["gaze"], dtype=np.float32) * np.array(row["size"], dtype=np.float32)
        shown, exact = (film(arguments.folder, row, method) for method in (row["method"], "exact"))
        jod, _ = metric.predict(
            shown, exact, dim_order="HWCF", frames_per_second=FRAMES_PER_SECOND, fixation_point=gaze
        )
        found.append({key: row[key] for key in ("volume", "base_density", "method")} | {"jod": round(float(jod), 3)})
        print(*found[-1].values(), flush=True)
    if arguments.out:
        arguments.out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()

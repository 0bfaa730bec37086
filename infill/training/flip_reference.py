"""What the package flip-evaluator says about two pairs of pictures that `gpu-testkit/src/flip.rs` makes by the same formulas.

    python flip_reference.py
"""

import flip_evaluator
import numpy as np


def smooth(x, y):
    """Reds, greens and blues, 0 to 255, that change slowly."""
    return [(3 * x + 5 * y) % 256, (7 * x + 2 * y + 40) % 256, (x * y // 4 + 90) % 256]


def edges(x, y):
    """A square on white with another grey around one pixel in seven."""
    inside = (x // 8 + y // 8) % 2 == 0
    grey = np.where(inside, 90, 255)
    dots = (x + 3 * y) % 7 == 0
    return [np.where(dots, 120, grey), grey, np.where(dots, 60, grey)]


def shifted(of, by):
    return lambda x, y: of(x + by, y)


def picture(of, width=40, height=28):
    y, x = np.mgrid[:height, :width]
    return np.stack(of(x, y), axis=2).astype(np.float32) / 255


def main():
    for name, test, reference in [("smooth", shifted(smooth, 4), smooth), ("edges", shifted(edges, 1), edges)]:
        _, mean, _ = flip_evaluator.evaluate(picture(reference), picture(test), "LDR", inputsRGB=True, applyMagma=False)
        print(f"{name}: {mean:.6f}")


if __name__ == "__main__":
    main()

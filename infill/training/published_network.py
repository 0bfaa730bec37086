"""The published in-fill network (Dyken, Usher, Kumar, TVCG 2024) in PyTorch.

A U-Net whose decoder sees its own features of the previous frame predicts a colour picture and, from the same
features, the kernels that filter that picture on the way down and up a pyramid.
"""

import torch
import torch.nn.functional as F
from torch import nn

CHANNELS = [4, 8, 16, 32]
# Added to the features before kernels are predicted from them, and to the picture.
FLOOR = 1e-7
# Width and height must be multiples of this.
ALIGNMENT = 8


def up(x):
    return F.interpolate(x, scale_factor=2, mode="bilinear", align_corners=False)


def filtered(picture, kernel_logits, same_level=None):
    """Every pixel's own 3x3 kernel over the picture, with a tenth tap on another picture of this level."""
    n, c, h, w = picture.shape
    taps = F.unfold(picture, 3, padding=1).view(n, c, 9, h, w)
    if same_level is not None:
        taps = torch.cat([taps, same_level.unsqueeze(2)], dim=2)
    squares = kernel_logits.square()
    kernel = squares / squares.sum(dim=1, keepdim=True)
    return (taps * kernel.unsqueeze(1)).sum(dim=2)


class PublishedNetwork(nn.Module):
    def __init__(self):
        super().__init__()
        pair = lambda i, o: nn.Sequential(nn.Conv2d(i, o, 3, padding=1), nn.Conv2d(o, o, 3, padding=1))
        for level, channels in enumerate(CHANNELS):
            self.add_module(f"enc{level}", pair(CHANNELS[level - 1] if level else 3, channels))
            self.add_module(f"down{level}", nn.Conv2d(channels, 9, 1))
            if level < 3:
                self.add_module(f"dec{level}", pair(2 * channels + CHANNELS[level + 1], channels))
                self.add_module(f"up{level}", nn.Conv2d(channels, 10, 1))
        self.rgb = nn.Conv2d(CHANNELS[0], 3, 1)

    @staticmethod
    def initial_state(height, width):
        return [torch.zeros(1, CHANNELS[level], height >> level, width >> level) for level in range(3)]

    def forward(self, picture, state):
        """The picture [1, 3, h, w] filled, and the state for the next frame."""
        module = lambda name, level: getattr(self, f"{name}{level}")
        convolved = lambda pair, x: F.relu(pair[1](F.relu(pair[0](x))))
        skips = [convolved(self.enc0, picture)]
        for level in range(1, 4):
            skips.append(convolved(module("enc", level), F.avg_pool2d(skips[-1], 2)))
        features = [None, None, None, skips[3]]
        for level in (2, 1, 0):
            x = torch.cat([skips[level], up(features[level + 1]), state[level]], dim=1)
            features[level] = convolved(module("dec", level), x)
        image = F.relu(self.rgb(features[0]))
        features = [f + FLOOR for f in features]

        images = []
        for level in range(4):
            source = F.avg_pool2d(images[-1], 2) if level else image
            images.append(filtered(source, module("down", level)(features[level])))
        image = images[3]
        for level in (2, 1, 0):
            image = filtered(up(image), module("up", level)(features[level]), images[level])
        return image + FLOOR, features[:3]

"""The network that weighs the candidates of unfinished pixels, as the crate `infill` computes it."""

import torch
import torch.nn.functional as F
from torch import nn

# Candidates in the crate's order: neighbours (push-pull), coarse field, its thin variant, history.
SOURCES = ["P", "L", "X", "R"]
# `infill::PRIOR`: logarithms of the candidates' weights without a network.
PRIOR = [0.1, 0.0, -5.6, 3.2]
# `infill::DOUBT`: how much less neighbours that disagree weigh.
DOUBT = 2.0
# Voxels at which a soft distance is one half.
HALF_DISTANCE = 8.0
FEATURES = 16
OUTPUTS = 6
# Width and height are padded with zeros to multiples of this.
ALIGNMENT = 4


def soft_distance(d):
    return d / (HALF_DISTANCE + d.abs())


def features(frame):
    """The inputs [n, 16, h, w] of a batch of frames: a dict of [n, h, w] tensors with the channels of data.py.

    At finished pixels every candidate equals the finished value and every distance is 0.
    """
    done = frame["finished"]
    own = [frame["c"], frame["c"] * frame["nv"]]
    inputs = [done, *(done * x for x in own)]
    distances = {}
    for source in SOURCES:
        valid, coverage = frame[f"v_{source}"], frame[f"c_{source}"] * frame[f"v_{source}"]
        if source == "R":
            inputs.append(torch.where(done > 0, done, valid))
        for finished, value in zip(own, [coverage, coverage * frame[f"nv_{source}"]]):
            inputs.append(torch.where(done > 0, finished, value))
        known = (done == 0) & (coverage > 0)
        distances[source] = torch.where(known, soft_distance(frame[f"d_{source}"]), torch.zeros_like(done))
    return torch.stack(inputs + [distances[s] for s in "LXPR"], dim=1)


def mix(frame, outputs, doubt=0.0, prior=PRIOR):
    """Coverage and N.V of holes from the candidates, the network's outputs [n, 6, h, w] and what it adds to DOUBT."""
    stacked = lambda name: torch.stack([frame[f"{name}_{s}"] for s in SOURCES], dim=1)
    valid, coverage, facing = stacked("v"), stacked("c"), stacked("nv")
    doubt = (DOUBT + doubt) * 4 * frame["c_P"] * (1 - frame["c_P"])
    logits = outputs[:, :4] + torch.tensor(prior, device=outputs.device).view(1, 4, 1, 1)
    logits = torch.cat([logits[:, :1] - doubt.unsqueeze(1), logits[:, 1:]], dim=1)
    # A pixel without any candidate has weights of 0 and so no coverage, as in the crate.
    weights = torch.softmax(logits.masked_fill(valid == 0, -1e9), dim=1) * valid
    covered = weights * coverage
    total = covered.sum(dim=1)
    mean = torch.where(total > 0, (covered * facing).sum(dim=1) / total.clamp(min=1e-12), torch.full_like(total, 0.5))
    # The gradients of values beyond the ends would vanish: the ends are applied by `shown`.
    return total + outputs[:, 4], mean + outputs[:, 5]


def shown(frame, coverage, facing):
    """Coverage and N.V of the shown picture: finished pixels keep theirs."""
    done = frame["finished"] > 0
    return (
        torch.where(done, frame["c"], coverage.clamp(0, 1)),
        torch.where(done, frame["nv"], facing.clamp(0, 1)),
    )


class Network(nn.Module):
    """A U-Net over three resolutions, 5,558 parameters, and what is added to DOUBT."""

    def __init__(self):
        super().__init__()
        conv = lambda i, o: nn.Conv2d(i, o, 3, padding=1)
        self.e0 = conv(FEATURES, 4)
        self.e1a, self.e1b = conv(4, 8), conv(8, 8)
        self.e2a, self.e2b = conv(8, 12), conv(12, 12)
        self.d1, self.d0 = conv(20, 8), conv(12, 4)
        self.head = nn.Conv2d(4, OUTPUTS, 1)
        self.doubt = nn.Parameter(torch.zeros(1), requires_grad=False)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)

    def forward(self, x):
        height, width = x.shape[2:]
        x = F.pad(x, (0, -width % ALIGNMENT, 0, -height % ALIGNMENT))
        up = lambda x: F.interpolate(x, scale_factor=2, mode="bilinear", align_corners=False)
        e0 = F.relu(self.e0(x))
        e1 = F.relu(self.e1b(F.relu(self.e1a(F.avg_pool2d(e0, 2)))))
        e2 = F.relu(self.e2b(F.relu(self.e2a(F.avg_pool2d(e1, 2)))))
        d1 = F.relu(self.d1(torch.cat([e1, up(e2)], dim=1)))
        d0 = F.relu(self.d0(torch.cat([e0, up(d1)], dim=1)))
        return self.head(d0)[:, :, :height, :width]

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
# What the network reads at a quad of 2x2 pixels.
FEATURES = 16
# What its head reads of a hole's own candidates.
OWN = 8
OUTPUTS = 6
# Width and height are padded with zeros to multiples of this.
ALIGNMENT = 4


def soft_distance(d):
    return d / (HALF_DISTANCE + d.abs())


def padded(x):
    """With zeros on the right and below."""
    height, width = x.shape[-2:]
    return F.pad(x, (0, -width % ALIGNMENT, 0, -height % ALIGNMENT))


def quads(x):
    """The four pixels [n, 4, h / 2, w / 2] of every quad of a padded [n, h, w], row by row."""
    n, height, width = x.shape
    return x.view(n, height // 2, 2, width // 2, 2).permute(0, 2, 4, 1, 3).reshape(n, 4, height // 2, width // 2)


def first_of(which):
    """Of every quad the first pixel of those for which `which` [n, 4, h, w] is 1, as an index for `gather`."""
    order = torch.tensor([4.0, 3.0, 2.0, 1.0], device=which.device).view(1, 4, 1, 1)
    return (which * order).argmax(dim=1, keepdim=True)


def picked(x, index):
    return x.gather(1, index).squeeze(1)


def features(frame):
    """The inputs [n, 16, h / 2, w / 2] of a batch of frames: a dict of [n, h, w] tensors with the channels of data.py.

    A quad has the mean of its finished pixels, and what the candidates say about its first hole; neighbours are asked for the
    whole quad, of history's hits the nearest one counts.
    """
    quad = lambda x: quads(padded(x))
    done, hole = quad(frame["finished"]), quad(1 - frame["finished"])
    done_share, hole_share = done.mean(dim=1), hole.mean(dim=1)
    mean = lambda x, of: (of * x).sum(dim=1) / of.sum(dim=1).clamp(min=1)
    c, nv = quad(frame["c"]), quad(frame["nv"])
    finished = [mean(c, done), mean(c * nv, done)]
    any_done = done_share > 0
    first = first_of(hole)
    inputs = [done_share, *(done_share * x for x in finished)]
    distances = {}
    for source in SOURCES:
        valid = quad(frame[f"v_{source}"])
        coverage = quad(frame[f"c_{source}"]) * valid
        facing = coverage * quad(frame[f"nv_{source}"])
        distance = quad(frame[f"d_{source}"])
        if source == "P":
            candidate = [mean(coverage, hole), mean(facing, hole)]
            inputs += [torch.where(any_done, own, other) for own, other in zip(finished, candidate)]
            known, distance = candidate[0] > 0, picked(distance, first)
        else:
            index = first
            if source == "R":
                index = torch.where(hole * valid > 0, distance, torch.full_like(distance, 1e9)).argmin(dim=1, keepdim=True)
                inputs.append(done_share + hole_share * picked(hole * valid, index))
            candidate = [picked(hole * coverage, index), picked(hole * facing, index)]
            inputs += [done_share * own + hole_share * other for own, other in zip(finished, candidate)]
            known, distance = candidate[0] > 0, picked(distance, index)
        distances[source] = torch.where(known, hole_share * soft_distance(distance), torch.zeros_like(distance))
    return torch.stack(inputs + [distances[s] for s in "LXPR"], dim=1)


def own_features(frame):
    """What the head reads of a pixel's own candidates [n, 8, h, w]: coverage and coverage N.V of each; of history, whose
    coverage is 1, the first says that there is one."""
    found = []
    for source in SOURCES:
        coverage = frame[f"c_{source}"] * frame[f"v_{source}"]
        found += [coverage, coverage * frame[f"nv_{source}"]]
    return torch.stack(found, dim=1)


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
    """Convolutions at a half and a quarter of the resolution, then a head for every hole: 4,982 parameters, and what is
    added to DOUBT."""

    def __init__(self):
        super().__init__()
        conv = lambda i, o: nn.Conv2d(i, o, 3, padding=1)
        self.e0 = conv(FEATURES, 8)
        self.e1a, self.e1b = conv(8, 12), conv(12, 12)
        self.d0 = conv(20, 8)
        self.hidden = nn.Conv2d(8 + OWN, 8, 1)
        self.head = nn.Conv2d(8, OUTPUTS, 1)
        self.doubt = nn.Parameter(torch.zeros(1), requires_grad=False)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)

    def forward(self, frame):
        last = torch.channels_last
        x, own = features(frame).to(memory_format=last), own_features(frame).to(memory_format=last)
        height, width = own.shape[2:]
        up = lambda x: F.interpolate(x, scale_factor=2, mode="bilinear", align_corners=False)
        e0 = F.relu(self.e0(x))
        e1 = F.relu(self.e1b(F.relu(self.e1a(F.avg_pool2d(e0, 2)))))
        d0 = F.relu(self.d0(torch.cat([e0, up(e1)], dim=1)))
        return self.head(F.relu(self.hidden(torch.cat([up(d0)[:, :, :height, :width], own], dim=1))))

"""Reference pictures for the tests of the published network: weights, frames and what the network makes of them.

    python reference.py random OUT.safetensors                      random weights, computed by PyTorch
    python reference.py onnx MODEL.onnx WEIGHTS.safetensors OUT.safetensors   the published ones, by ONNX Runtime

The first is committed as ../tests/data/published.safetensors. For the second, name OUT in PUBLISHED_INFILL_VECTOR and run
`cargo test -p infill --features published-network -- --ignored`. A file has the weights, `color` [frames, h, w, 4] and `status`
[frames, h, w] in bytes and `filled` [frames, h, w, 3].
"""

import sys

import numpy as np
import onnx
import onnxruntime
import torch
from onnx import numpy_helper
from safetensors.numpy import load_file, save_file

import shading
from published_network import CHANNELS, PublishedNetwork

FRAMES = 3
UNFINISHED = 2


def smooth(rng, height, width):
    """Waves of a few random lengths, within about -1 to 1."""
    y, x = np.mgrid[:height, :width] / 8.0
    waves = [np.sin(a * x + b * y + c) for a, b, c in rng.uniform(-1, 1, (6, 3)) * [2, 2, 6]]
    return sum(waves) / 3


def frames(rng, height, width):
    """A shaded surface with background, part of it unfinished: colours and status in bytes."""
    field, facing = smooth(rng, height, width), smooth(rng, height, width)
    colors, statuses = [], []
    for frame in range(FRAMES):
        coverage = torch.tensor(np.roll(field, frame, axis=1) > -0.2).float()[None]
        color = shading.picture(coverage, torch.tensor(np.clip(0.6 + 0.4 * facing, 0, 1)).float()[None])
        rgb = (color[0].permute(1, 2, 0).numpy() * 255 + 0.5).astype(np.uint8)
        status = coverage[0].numpy().astype(np.uint8)
        status[smooth(rng, height, width) + 0.4 * rng.normal(size=(height, width)) > 0.7] = UNFINISHED
        colors.append(np.concatenate([rgb, np.full((height, width, 1), 255, np.uint8)], axis=2))
        statuses.append(status)
    return np.stack(colors), np.stack(statuses)


def network_input(color, status):
    """[1, 3, h, w] as the published renderer shows it to the network."""
    picture = color[..., :3].astype(np.float32) / 255
    picture[status == UNFINISHED] = shading.UNFINISHED
    return np.ascontiguousarray(picture.transpose(2, 0, 1)[None])


def random_weights(rng):
    """Weights with which activations neither vanish nor explode over the layers."""
    state = PublishedNetwork().state_dict()
    weights = {}
    for name, tensor in state.items():
        if name.endswith("bias"):
            weights[name] = rng.uniform(-0.1, 0.2, tensor.shape).astype(np.float32)
        else:
            limit = (6 / np.prod(tensor.shape[1:])) ** 0.5
            weights[name] = rng.uniform(-limit, limit, tensor.shape).astype(np.float32)
    return weights


def by_pytorch(weights, inputs):
    network = PublishedNetwork()
    network.load_state_dict({name: torch.from_numpy(value) for name, value in weights.items()})
    state = network.initial_state(*inputs[0].shape[2:])
    filled = []
    with torch.no_grad():
        for picture in inputs:
            image, state = network(torch.from_numpy(picture), state)
            filled.append(image[0].permute(1, 2, 0).numpy())
    return filled


def resized(model, height, width):
    """The published graph, whose size is fixed, for another one."""
    old_height, old_width = (d.dim_value for d in model.graph.input[0].type.tensor_type.shape.dim[2:])
    for node in model.graph.node:
        if node.op_type == "Constant":
            value = numpy_helper.to_array(node.attribute[0].t)
            if value.shape == (5,):
                changed = np.array([*value[:3], value[3] * height // old_height, value[4] * width // old_width])
                node.attribute[0].t.CopyFrom(numpy_helper.from_array(changed))
    for value in [*model.graph.input, *model.graph.output]:
        dims = value.type.tensor_type.shape.dim
        dims[2].dim_value = dims[2].dim_value * height // old_height
        dims[3].dim_value = dims[3].dim_value * width // old_width
    return model


class OnnxNetwork:
    """The published model in ONNX Runtime, with its state."""

    STATES = ["onnx::Concat_5", "input5", "input4"]

    def __init__(self, path, height, width, threads=1):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        model = resized(onnx.load(path), height, width)
        self.session = onnxruntime.InferenceSession(model.SerializeToString(), options)
        self.size = height, width
        self.clear()

    def clear(self):
        height, width = self.size
        self.state = [np.zeros((1, CHANNELS[l], height >> l, width >> l), np.float32) for l in range(3)]

    def __call__(self, picture):
        outputs = ["output1", "input.128", "output5", "output4"]
        feed = {"input1": picture, **dict(zip(self.STATES, self.state))}
        filled, *self.state = self.session.run(outputs, feed)
        return filled


def by_onnx(path, inputs):
    network = OnnxNetwork(path, *inputs[0].shape[2:])
    return [network(picture)[0].transpose(1, 2, 0) for picture in inputs]


def main():
    kind, *paths = sys.argv[1:]
    rng = np.random.default_rng(6)
    height, width = (24, 40) if kind == "random" else (72, 136)
    color, status = frames(rng, height, width)
    inputs = [network_input(*frame) for frame in zip(color, status)]
    if kind == "random":
        weights = random_weights(rng)
        filled = by_pytorch(weights, inputs)
    else:
        weights = load_file(paths[1])
        filled = by_onnx(paths[0], inputs)
    filled = np.stack(filled)
    print(f"filled {filled.min():.3f} to {filled.max():.3f}, {(status == UNFINISHED).mean():.0%} unfinished")
    # The file has the bytes as they lie in memory.
    pictures = {"color": color, "status": status, "filled": filled}
    save_file({**weights, **{name: np.ascontiguousarray(value) for name, value in pictures.items()}}, paths[-1])


if __name__ == "__main__":
    main()

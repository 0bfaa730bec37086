"""The weights of the published network as safetensors with the names of published_network.py.

    python convert_published.py IN.onnx OUT.safetensors

IN.onnx is the file that the authors of the paper publish (Dyken, Usher, Kumar, TVCG 2024).
"""

import re
import sys

import onnx
from onnx import numpy_helper
from safetensors.numpy import save_file

# Nested stages: the depth of nesting is the level.
PATTERNS = [
    (r"feature_model\.((?:encoder_decoder\.)+)encoder_stage\.conv_groups\.(\d)\.conv\.(\w+)", "enc{level}.{conv}.{part}"),
    (r"feature_model\.((?:encoder_decoder\.)+)decoder_stage\.conv_groups\.(\d)\.conv\.(\w+)", "dec{level}.{conv}.{part}"),
    (r"feature_model\.()()conv\.(\w+)", "rgb.{part}"),
    (r"filter_model\.((?:filter_path\.)*)()encoder_filter_stage\.filter_predict\.(\w+)", "down{level}.{part}"),
    (r"filter_model\.((?:filter_path\.)*)()decoder_filter_stage\.filter_predict\.(\w+)", "up{level}.{part}"),
]


def clear_name(name):
    """The name of a tensor here; an error for a tensor of another network."""
    for pattern, template in PATTERNS:
        match = re.fullmatch(pattern, name)
        if match:
            nesting, conv, part = match.groups()
            # Encoders and decoders of the feature network are one nesting deeper than their level.
            level = nesting.count(".") - (1 if name.startswith("feature_model.encoder") else 0)
            return template.format(level=level, conv=conv, part=part)
    raise ValueError(f"a tensor of another network: {name}")


def main():
    source, target = sys.argv[1:]
    graph = onnx.load(source).graph
    tensors = {clear_name(t.name): numpy_helper.to_array(t) for t in graph.initializer}
    save_file(tensors, target)
    count = sum(t.size for t in tensors.values())
    print(f"{len(tensors)} tensors, {count} parameters")


if __name__ == "__main__":
    main()

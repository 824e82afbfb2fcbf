"""Shipped policy in the forms of user-supplied ones: ONNX file and Python factory, each with its TOML file."""

import shutil
from importlib.resources import files

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from aero.policy.network import ACTION_BOUND
from aero.policy.shipped import find_policy

FACTORY = '''
"""The shipped policy, as somebody would write it."""
import numpy as np
from aero.policy.shipped import find_policy

def make():
    network = find_policy("steady").network
    return lambda observation: network.act(observation)
'''


def write_interface(path):
    shutil.copy(str(files("aero.policy.shipped") / "steady.toml"), path)


def write_onnx(folder, name="mine"):
    """Write `steady` as NAME.onnx; the observation is normalised in double precision, as in NumPy."""
    network = find_policy("steady").network
    nodes, weights, x = [], [], "observation"

    def add(operator, inputs, output, **attributes):
        nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    def constant(label, values):
        weights.append(numpy_helper.from_array(values, label))
        return label

    x = add("Sub", [x, constant("mean", network.mean.astype(np.float64))], "centred")
    x = add("Div", [x, constant("std", network.std.astype(np.float64))], "normalised")
    x = add("Cast", [x], "single", to=TensorProto.FLOAT)
    for i, layer in enumerate(network.layers):
        x = add("Gemm", [x, constant(f"kernel_{i}", layer.kernel), constant(f"bias_{i}", layer.bias)], f"layer_{i}")
        if layer is not network.layers[-1]:
            x = add("Mul", [x, add("Sigmoid", [x], f"gate_{i}")], f"swish_{i}")
    ends = [constant(label, np.array([at])) for label, at in (("from", 0), ("to", 7), ("axis", 1))]
    x = add("Slice", [x, *ends], "head")
    x = add("Tanh", [x], "bounded")
    bounds = [constant(f"bound_{sign}", np.float32(sign * ACTION_BOUND)) for sign in (-1, 1)]
    add("Clip", [x, *bounds], "action")
    graph = helper.make_graph(
        nodes, "steady",
        [helper.make_tensor_value_info("observation", TensorProto.DOUBLE, ["batch", 14])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["batch", 7])],
        weights,
    )  # fmt: skip
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    path = folder / f"{name}.onnx"
    onnx.save(model, path)
    write_interface(path.with_suffix(".toml"))
    return str(path)


def write_model(path, nodes, constants):
    """Write an unchecked ONNX model of 14 numbers to 7, and its TOML file."""
    graph = helper.make_graph(
        nodes, "model",
        [helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["batch", 14])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["batch", 7])],
        [numpy_helper.from_array(values, name) for name, values in constants.items()],
    )  # fmt: skip
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)
    write_interface(path.with_suffix(".toml"))


def write_factory(folder, name="my_policy"):
    """Write `steady` as a Python module in `folder`, which must be the working folder or on the path."""
    (folder / f"{name}.py").write_text(FACTORY)
    write_interface(folder / f"{name}.toml")
    return f"{name}:make"

# SPDX-License-Identifier: GPL-3.0-or-later
"""Field files: exact round trips, the authors' checkpoints, and files that mean harm."""

import io
import json
import os
import pickle
import struct
import threading
import zipfile
from itertools import pairwise

import numpy as np
import pytest
import safetensors.torch
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch.nn.utils import weight_norm

import neural_sculpt_addon.field
from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.checkpoint import from_bytes, load, save, to_bytes
from neural_sculpt_addon.field.detail import Detail
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.network import Siren
from tests.field.networks import MODELS, PACKED, network_of
from tests.field.random_layers import layers, random_layer, same

pytestmark = pytest.mark.filterwarnings("ignore:.*weight_norm. is deprecated")


class Sine(torch.nn.Module):
    """A layer of the authors' network, as their checkpoints name it."""

    def __init__(self, fan_in, fan_out, omega, norm):
        super().__init__()
        linear = torch.nn.Linear(fan_in, fan_out)
        self.linear = weight_norm(linear) if norm else linear
        self.omega = omega

    def forward(self, x):
        return torch.sin(self.omega * self.linear(x))


def authors_network(norm, widths=(16, 12), first=30.0, hidden=20.0):
    """A torch module with the authors' parameter names, and its checkpoint's bytes."""
    torch.manual_seed(5)
    sizes = (3, *widths)
    layers = [
        Sine(a, b, first if k == 0 else hidden, norm) for k, (a, b) in enumerate(pairwise(sizes))
    ]
    last = torch.nn.Linear(widths[-1], 1)
    net = torch.nn.Sequential(*layers, weight_norm(last) if norm else last)
    holder = torch.nn.Module()
    holder.net = net
    if norm:  # training moves g away from |v|
        for name, parameter in holder.named_parameters():
            if name.endswith("weight_g"):
                parameter.data *= 1.7
    checkpoint = {
        "in_features": 3,
        "out_features": 1,
        "hidden_features": list(widths),
        "outermost_linear": True,
        "first_omega_0": first,
        "hidden_omega_0": hidden,
        "weight_norm": norm,
        "state_dict": holder.state_dict(),
    }
    return net, checkpoint


def pth(checkpoint):
    buffer = io.BytesIO()
    torch.save(checkpoint, buffer)
    return buffer.getvalue()


def refused(path, data, match=None):
    path.write_bytes(data)
    with pytest.raises(SculptError, match=match) as caught:
        load(path)
    message = str(caught.value)
    assert path.name in message
    assert "\n" not in message
    assert len(message) < 300


def identical(a, b):
    return (
        a.network.omegas == b.network.omegas
        and all(map(torch.equal, a.network.parameters, b.network.parameters))
        and same(a.detail.coefficients, b.detail.coefficients)
    )


def some_field(widths=(12, 9), omega=30.0, detail=None):
    network = Siren.random(widths, omega, torch.Generator().manual_seed(0))
    return Field(network, detail or Detail())


def detailed():
    return some_field(detail=Detail.of(random_layer(0), random_layer(1)))


@pytest.mark.parametrize("suffix", [".safetensors", ".pth", ".PTH"])
@pytest.mark.parametrize(
    "field", [some_field(), some_field((7,)), some_field((5, 6, 7), (30.0, 20.0, 20.0))]
)
def test_files_round_trip_bit_by_bit(tmp_path, suffix, field):
    save(field, tmp_path / f"field{suffix}")
    assert identical(load(str(tmp_path / f"field{suffix}")), field)


@settings(deadline=None, max_examples=20)
@given(
    st.lists(st.tuples(st.integers(1, 9), st.floats(0.1, 100)), min_size=1, max_size=5),
    st.integers(0, 99),
    st.lists(layers(), max_size=2),
)
def test_bytes_round_trip_bit_by_bit(shape, seed, added):
    widths, omegas = zip(*shape, strict=True)
    network = Siren.random(widths, omegas, torch.Generator().manual_seed(seed))
    field = Field(network, Detail.of(*added))
    assert identical(from_bytes(to_bytes(field)), field)


def test_learning_and_float64_networks_are_written_as_plain_float32():
    network = some_field().network
    learning = network.with_parameters([p.clone().requires_grad_() for p in network.parameters])
    assert identical(from_bytes(to_bytes(Field(learning))), Field(network))
    double = network.with_parameters([p.double() for p in network.parameters])
    read = from_bytes(to_bytes(Field(double))).network
    assert all(p.dtype == torch.float32 and not p.requires_grad for p in read.parameters)


def test_tensors_that_share_memory_are_written():
    one = torch.ones(1)
    field = Field(Siren((torch.zeros(1, 3), torch.ones(1, 1)), (one, one), (1.0,)))
    assert identical(from_bytes(to_bytes(field)), field)


@pytest.mark.parametrize("field", [some_field(), detailed()])
def test_the_same_field_gives_the_same_bytes(field):
    assert len({to_bytes(field) for _ in range(20)}) == 1
    assert to_bytes(from_bytes(to_bytes(field))) == to_bytes(field)


def test_a_field_with_detail_samples_alike_after_saving(tmp_path):
    field = detailed()
    save(field, tmp_path / "field.safetensors")
    x = np.random.default_rng(0).uniform(-1, 1, (5000, 3))
    before, after = field.sample(x), load(tmp_path / "field.safetensors").sample(x)
    np.testing.assert_array_equal(before.f, after.f)
    np.testing.assert_array_equal(before.gradient, after.gradient)
    assert (before.f != values(Field(field.network), x)).any()


def test_scripts_come_in_by_load(tmp_path):
    save(detailed(), tmp_path / "field.safetensors")
    field = neural_sculpt_addon.field.load(str(tmp_path / "field.safetensors"))
    x = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    f, gradient = field.sample(x)
    assert (f.shape, f.dtype) == ((50,), np.float32)
    assert (gradient.shape, gradient.dtype) == ((50, 3), np.float32)
    along = torch.tensor(x, dtype=torch.float32, requires_grad=True)
    field.network.value(along).sum().backward()
    slope = along.grad.numpy() + central_differences(field.detail, x)
    np.testing.assert_allclose(gradient, slope, atol=2e-3)
    assert field.sample(np.zeros((0, 3))).gradient.shape == (0, 3)
    for wrong in (np.zeros(3), np.zeros((3, 2)), np.zeros((2, 3, 3)), [["a", "b", "c"]], None):
        with pytest.raises(SculptError, match=r"\(N, 3\)"):
            field.sample(wrong)


def central_differences(detail, x, step=1e-3):
    """The gradient (N, 3) of a detail at x (N, 3)."""

    def value(points):
        total = torch.zeros(len(points), dtype=torch.float64)
        detail.add_value(torch.from_numpy(points), total)
        return total.numpy()

    steps = step * np.eye(3)
    return np.stack([(value(x + s) - value(x - s)) / (2 * step) for s in steps], axis=1)


def test_detail_that_was_taken_away_again_leaves_no_trace():
    field = some_field(detail=Detail.of(random_layer(0)).plus(random_layer(0), -1))
    assert to_bytes(field) == to_bytes(some_field())


def test_only_fields_with_detail_need_the_new_format(tmp_path):
    for field, version in ((some_field(), "1"), (detailed(), "2")):
        save(field, tmp_path / "field.safetensors")
        with safetensors.safe_open(tmp_path / "field.safetensors", "np") as file:
            assert file.metadata()["version"] == version
            assert ("detail" in file.keys()) == (version == "2")  # noqa: SIM118


def test_detail_has_no_place_in_the_authors_format(tmp_path):
    with pytest.raises(SculptError, match=r"--solver network.*Consolidate"):
        save(detailed(), tmp_path / "field.pth")
    assert not list(tmp_path.iterdir())


def test_our_format_is_safetensors_that_others_can_read(tmp_path):
    save(some_field(), tmp_path / "field.safetensors")
    with safetensors.safe_open(tmp_path / "field.safetensors", "np") as file:
        assert set(file.keys()) == {f"layers.{k}.{w}" for k in range(3) for w in ("weight", "bias")}
        assert file.get_tensor("layers.1.weight").shape == (9, 12)
        metadata = file.metadata()
    assert metadata["format"] == "neural-sculpt-field"
    assert json.loads(metadata["omegas"]) == [30.0, 30.0]


@pytest.mark.parametrize("norm", [False, True])
@pytest.mark.parametrize("widths", [(16, 12), (8,), (6, 6, 6)])
def test_the_authors_checkpoints(tmp_path, norm, widths):
    net, checkpoint = authors_network(norm, widths)
    (tmp_path / "net.pth").write_bytes(pth(checkpoint))
    field = load(tmp_path / "net.pth")
    assert field.network.widths == widths
    x = torch.rand(200, 3, generator=torch.Generator().manual_seed(3)) * 2 - 1
    expected = net.double()(x.double())[:, 0].detach()
    rough = 4e-3 if len(widths) > 2 else 2e-4  # float32 through omega = 30, layer by layer
    np.testing.assert_allclose(values(field, x.numpy()), expected, atol=rough)


def test_what_is_written_as_pth_loads_into_the_authors_module(tmp_path):
    net, checkpoint = authors_network(norm=False)
    field = some_field((16, 12), (30.0, 20.0))
    save(field, tmp_path / "out.pth")
    written = torch.load(tmp_path / "out.pth", weights_only=True)
    assert set(written) == set(checkpoint)
    assert {k: v for k, v in written.items() if k != "state_dict"} == {
        k: v for k, v in checkpoint.items() if k != "state_dict"
    }
    holder = torch.nn.Module()
    holder.net = net
    holder.load_state_dict(written["state_dict"])
    x = torch.rand(100, 3)
    np.testing.assert_allclose(field.value(x), net(x)[:, 0].detach(), atol=1e-5)


@pytest.mark.parametrize("model", MODELS)
def test_networks_of_shapes(model):
    field = network_of(model)
    packed = (PACKED / f"{model}.pth").exists()
    assert field.network.widths == ((64, 64) if packed else (128, 128))
    assert field.network.omegas == ((48.0, 30.0) if packed else (30.0, 30.0))
    x = np.random.default_rng(0).uniform(-1, 1, (4000, 3))
    outside = values(field, x[np.linalg.norm(x, axis=1) > 1.2])
    assert (outside > 0).mean() > 0.99  # negative inside


def test_half_precision_weights_are_read(tmp_path):
    _, checkpoint = authors_network(norm=False)
    state = checkpoint["state_dict"]
    checkpoint["state_dict"] = {k: v.to(torch.bfloat16) for k, v in state.items()}
    (tmp_path / "half.pth").write_bytes(pth(checkpoint))
    network = load(tmp_path / "half.pth").network
    assert all(p.dtype == torch.float32 for p in network.parameters)
    torch.testing.assert_close(
        network.weights[0], state["net.0.linear.weight"], rtol=0.01, atol=0.01
    )


class Harm:
    """An object whose unpickling would write a file."""

    def __init__(self, marker):
        self.marker = marker

    def __reduce__(self):
        return os.system, (f"touch {self.marker}",)


@pytest.mark.parametrize("wrap", [lambda harm: harm, lambda harm: {"state_dict": harm}])
def test_a_malicious_pickle_is_not_executed(tmp_path, wrap):
    marker = tmp_path / "executed"
    data = pth(wrap(Harm(marker)))
    torch.load(io.BytesIO(data), weights_only=False)
    assert marker.exists()  # the file would do harm
    marker.unlink()
    refused(tmp_path / "evil.pth", data, "nothing in it was executed")
    refused(tmp_path / "bare.pth", pickle.dumps(wrap(Harm(marker))))
    refused(tmp_path / "evil.safetensors", data)
    assert not marker.exists()


def test_a_whole_module_is_refused(tmp_path):
    refused(tmp_path / "module.pth", pth(torch.nn.Linear(3, 1)), "nothing in it was executed")


@pytest.mark.parametrize("suffix", [".safetensors", ".pth"])
@pytest.mark.parametrize("share", [0.0, 0.001, 0.1, 0.5, 0.9, 0.999])
def test_truncated_files(tmp_path, suffix, share):
    save(some_field(), tmp_path / f"whole{suffix}")
    data = (tmp_path / f"whole{suffix}").read_bytes()
    refused(tmp_path / f"cut{suffix}", data[: int(share * len(data))])


@pytest.mark.parametrize("suffix", [".safetensors", ".pth"])
def test_files_of_another_kind(tmp_path, suffix):
    for number, data in enumerate([b"", b"hello", b"\x80\x04N.", b"PK\x05\x06" + 18 * b"\0"]):
        refused(tmp_path / f"{number}{suffix}", data)
    refused(tmp_path / f"noise{suffix}", np.random.default_rng(0).bytes(5000))


def test_an_archive_that_unpacks_to_gigabytes(tmp_path):
    save(some_field(), tmp_path / "plain.pth")
    buffer = io.BytesIO()
    with (
        zipfile.ZipFile(tmp_path / "plain.pth") as plain,
        zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as bomb,
    ):
        for entry in plain.infolist():
            bomb.writestr(entry.filename, plain.read(entry))
        with bomb.open("archive/data/99", "w", force_zip64=True) as file:
            for _ in range(257):
                file.write(bytes(1 << 20))
    assert len(buffer.getvalue()) < 4 << 20
    refused(tmp_path / "bomb.pth", buffer.getvalue(), "256 MiB")


def test_a_file_too_large_is_not_even_read(tmp_path):
    path = tmp_path / "large.safetensors"
    with path.open("wb") as file:
        file.truncate((256 << 20) + 1)
    with pytest.raises(SculptError, match="256 MiB"):
        load(path)


def altered(change, norm=False):
    _, checkpoint = authors_network(norm)
    state = dict(checkpoint["state_dict"])
    change(checkpoint, state)
    return pth({**checkpoint, "state_dict": state} if "state_dict" in checkpoint else checkpoint)


def poison(value):
    def change(_, state):
        state["net.1.linear.weight"] = state["net.1.linear.weight"].clone()
        state["net.1.linear.weight"][2, 3] = value

    return change


CHANGES = {
    "NaN": poison(float("nan")),
    "infinite": poison(float("inf")),
    "too large for float32": lambda _, s: s.update(
        {k: v.double() * 1e300 for k, v in s.items() if "weight" in k}
    ),
    "2-D input": lambda _, s: s.update({"net.0.linear.weight": torch.zeros(16, 2)}),
    "4-D output": lambda _, s: s.update({"net.2.weight": torch.zeros(4, 12)}),
    "layers that do not fit": lambda _, s: s.update({"net.1.linear.weight": torch.zeros(12, 15)}),
    "a bias that does not fit": lambda _, s: s.update({"net.1.linear.bias": torch.zeros(11)}),
    "a scalar": lambda _, s: s.update({"net.1.linear.bias": torch.tensor(1.0)}),
    "integers": lambda _, s: s.update({"net.2.bias": torch.zeros(1, dtype=torch.int64)}),
    "complex numbers": lambda _, s: s.update({"net.2.bias": torch.zeros(1, dtype=torch.cfloat)}),
    "a list": lambda _, s: s.update({"net.2.bias": [0.0]}),
    "a sparse tensor": lambda _, s: s.update({"net.2.weight": torch.ones(1, 12).to_sparse()}),
    "a tensor without data": lambda _, s: s.update(
        {"net.2.weight": torch.zeros(1, 12, device="meta")}
    ),
    "a layer without units": lambda _, s: s.update(
        {
            "net.1.linear.weight": torch.zeros(0, 16),
            "net.1.linear.bias": torch.zeros(0),
            "net.2.weight": torch.zeros(1, 0),
        }
    ),
    "a missing bias": lambda _, s: s.pop("net.1.linear.bias"),
    "a missing layer": lambda _, s: [s.pop(k) for k in list(s) if k.startswith("net.1")],
    "no layers": lambda _, s: s.clear(),
    "a layer more": lambda _, s: s.update({"other.7.weight": torch.zeros(1, 12)}),
    "a number as name": lambda _, s: s.update({7: torch.zeros(1)}),
    "no omega": lambda c, _: c.pop("first_omega_0"),
    "an omega of zero": lambda c, _: c.update(hidden_omega_0=0.0),
    "an omega of NaN": lambda c, _: c.update(hidden_omega_0=float("nan")),
    "an omega in words": lambda c, _: c.update(hidden_omega_0="thirty"),
    "an omega of 1e30": lambda c, _: c.update(first_omega_0=1e30),
    "a huge omega": lambda c, _: c.update(hidden_omega_0=10**400),
    "no state": lambda c, _: c.pop("state_dict"),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_networks_of_the_wrong_shape_or_content(tmp_path, change):
    refused(tmp_path / "wrong.pth", altered(change))


@pytest.mark.parametrize(
    "change",
    [
        lambda _, s: s.update({"net.1.linear.weight_g": torch.ones(7, 1)}),
        lambda _, s: s.update({"net.1.linear.weight_v": torch.ones(7)}),
        lambda _, s: s.update({"net.1.linear.weight_v": torch.zeros(12, 16)}),
        lambda _, s: s.update({"net.1.linear.weight_v": torch.ones(12, 16, dtype=torch.int32)}),
        lambda _, s: s.update({"net.1.linear.weight_g": "one"}),
        lambda _, s: s.pop("net.1.linear.weight_g"),
        # Some bytes on disk, 4 TB in memory.
        lambda _, s: s.update({"net.1.linear.weight_v": torch.ones(1).expand(10**6, 10**6)}),
        lambda _, s: s.update(
            {
                "net.1.linear.weight_v": torch.ones(1, 10**6),
                "net.1.linear.weight_g": torch.ones(10**6, 1),
            }
        ),
    ],
)
def test_wrong_weight_norm(tmp_path, change):
    refused(tmp_path / "wrong.pth", altered(change, norm=True))


@pytest.mark.parametrize(
    "checkpoint",
    [
        *(None, 5, [], {}, torch.zeros(3), {"state_dict": None}, {"state_dict": torch.zeros(3)}),
        {"state_dict": {}, "first_omega_0": 30.0, "hidden_omega_0": 30.0},
        {"state_dict": {"net": torch.ones(1)}, "first_omega_0": 30.0, "hidden_omega_0": 30.0},
    ],
)
def test_checkpoints_of_something_else(tmp_path, checkpoint):
    refused(tmp_path / "other.pth", pth(checkpoint))


def ours(change=lambda tensors, metadata: None, field=None):
    data = to_bytes(field or some_field())
    tensors = safetensors.torch.load(data)
    size = int.from_bytes(data[:8], "little")
    metadata = json.loads(data[8 : 8 + size])["__metadata__"]
    change(tensors, metadata)
    return safetensors.torch.save(tensors, metadata)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda t, m: m.update(format="other"), "no neural field"),
        (lambda t, m: m.clear(), "no neural field"),
        (lambda t, m: m.update(version="3"), "version 3.*Update Neural Sculpt"),
        (lambda t, m: m.update(version="v" * 5000), "Update Neural Sculpt"),
        (lambda t, m: m.update(version="2"), "lacks its detail"),
        (lambda t, m: m.pop("version"), "version"),
        (lambda t, m: m.pop("omegas"), "lacks a part"),
        *((lambda t, m, o=o: m.update(omegas=o), None) for o in ("[30.0]", "[30, -1]", "[NaN, 1]")),
        *(
            (lambda t, m, o=o: m.update(omegas=o), None)
            for o in ("5", "thirty", '["a", "b"]', "{}")
        ),
        (lambda t, m: m.update(omegas="[" * 100_000), None),
        (lambda t, m: m.update(omegas="[1, 1" + "0" * 400 + "]"), None),
        (lambda t, m: t.pop("layers.1.bias"), None),
        (lambda t, m: t.clear(), None),
        (
            lambda t, m: t.update({"layers.3.weight": torch.zeros(1), "layers.x": torch.ones(1)}),
            None,
        ),
        (lambda t, m: t["layers.0.weight"].fill_(float("nan")), "NaN"),
        (lambda t, m: t.update({"layers.0.weight": torch.zeros(12, 4)}), "layer 1"),
        (lambda t, m: t.update({"layers.0.weight": torch.zeros([1] * 5000)}), "layer 1"),
        (
            lambda t, m: t.update(
                {
                    "layers.0.weight": torch.zeros(0, 3),
                    "layers.0.bias": torch.zeros(0),
                    "layers.1.weight": torch.zeros(9, 0),
                }
            ),
            "layer 1",
        ),
        (lambda t, m: m.update(omegas="[30.0, 1e30]"), "beyond 10000"),
        (lambda t, m: t["layers.1.bias"].fill_(-1e30), "beyond 10000"),
        (lambda t, m: t["layers.1.weight"].fill_(1e38), "beyond 10000"),
        (lambda t, m: t.update({"layers.2.bias": torch.zeros(1, dtype=torch.int8)}), "floating"),
    ],
)
def test_safetensors_of_something_else(tmp_path, change, match):
    refused(tmp_path / "wrong.safetensors", ours(change), match)


@pytest.mark.parametrize(
    "change",
    [
        lambda t, m: t.pop("detail"),
        lambda t, m: t.update(detail=torch.zeros(0, dtype=torch.uint8)),
        lambda t, m: t.update(detail=t["detail"][:-1].clone()),
        lambda t, m: t.update(detail=t["detail"].view(1, -1)),
        lambda t, m: t.update(detail=t["detail"].float()),
        lambda t, m: m.update(version="1"),
    ],
)
def test_detail_of_something_else(tmp_path, change):
    refused(tmp_path / "wrong.safetensors", ours(change, detailed()))


def test_numbers_that_would_overflow_are_refused(tmp_path):
    """Each number is within its bound; together they are steeper than float32 can tell."""
    network = some_field((64,) * 8, 1e4).network
    steep = network.with_parameters([torch.full_like(p, 5e3) for p in network.parameters])
    x = torch.rand(10, 3)
    assert not torch.isfinite(steep.value_and_gradient(x)[1]).all()
    refused(tmp_path / "steep.safetensors", to_bytes(Field(steep)), "steeper")


def test_a_million_tensors_are_refused_at_once(tmp_path):
    entry = {"dtype": "F32", "shape": [0], "data_offsets": [0, 0]}
    header = {f"layers.{k}.bias": entry for k in range(10**5)}
    text = json.dumps({"__metadata__": {"format": "neural-sculpt-field"}, **header}).encode()
    data = struct.pack("<Q", len(text)) + text
    refused(tmp_path / "many.safetensors", data, "more tensors")
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for number in range(5000):
            archive.writestr(f"archive/data/{number}", b"")
    refused(tmp_path / "many.pth", buffer.getvalue(), "more tensors")
    shared = torch.zeros(1)
    state = {f"net.{k}.weight": shared for k in range(10**4)}
    refused(tmp_path / "shared.pth", pth({"state_dict": state}), "more tensors")


def test_safetensors_with_a_lying_header(tmp_path):
    for header in (
        {"layers.0.weight": {"dtype": "F32", "shape": [10**9, 3], "data_offsets": [0, 4]}},
        {"__metadata__": None},
        {"__metadata__": {"format": 5}},
        [],
    ):
        text = json.dumps(header).encode()
        data = struct.pack("<Q", len(text)) + text + bytes(4)
        refused(tmp_path / "lie.safetensors", data)
    refused(tmp_path / "lie.safetensors", struct.pack("<Q", 2**63) + b"{}")


@settings(deadline=None, max_examples=150)
@given(st.data())
def test_any_damage_is_a_field_or_a_sculpt_error(tmp_path_factory, data):
    """Bytes overwritten anywhere in a file, the pickle of a .pth included."""
    suffix = data.draw(st.sampled_from(list(GOOD)))
    whole = bytearray(GOOD[suffix])
    # Half of the damage goes into the pickle, or the header.
    first = whole.find(b"state_dict") - 200 if suffix == ".pth" else 0
    place = data.draw(st.integers(0, len(whole) - 1) | st.integers(max(first, 0), first + 1500))
    damage = data.draw(st.binary(min_size=1, max_size=8))
    whole[place : place + len(damage)] = damage
    path = tmp_path_factory.getbasetemp() / f"damaged{suffix}"
    path.write_bytes(whole)
    try:
        field = load(path)
    except SculptError as error:
        assert "\n" not in str(error)
        return
    x = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    f, gradient = field.sample(x)
    assert np.isfinite(f).all() and np.isfinite(gradient).all()


GOOD = {
    ".pth": pth(authors_network(norm=True)[1]),
    ".safetensors": to_bytes(some_field()),
    "-detail.safetensors": to_bytes(detailed()),
}


@pytest.mark.parametrize("name", ["field.obj", "field", "field.pth.txt"])
def test_other_suffixes(tmp_path, name):
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(SculptError, match="safetensors"):
        load(tmp_path / name)
    with pytest.raises(SculptError, match="safetensors"):
        save(some_field(), tmp_path / name)


def test_what_cannot_be_read(tmp_path):
    with pytest.raises(SculptError, match=r"absent\.pth cannot be read"):
        load(tmp_path / "absent.pth")
    (tmp_path / "folder.pth").mkdir()
    with pytest.raises(SculptError, match="cannot be read"):
        load(tmp_path / "folder.pth")


def test_devices_are_not_read_to_their_end():
    if not os.path.exists("/dev/zero"):
        pytest.skip("this system has no /dev/zero")
    with pytest.raises(SculptError):
        load("/dev/zero")


def test_what_cannot_be_written_leaves_nothing_behind(tmp_path):
    with pytest.raises(SculptError, match="cannot be written"):
        save(some_field(), tmp_path / "absent" / "field.pth")
    (tmp_path / "folder.pth").mkdir()
    (tmp_path / "folder.pth" / "full").touch()
    with pytest.raises(SculptError, match="cannot be written"):
        save(some_field(), tmp_path / "folder.pth")
    with pytest.raises(SculptError, match="cannot be written"):
        save(some_field(), tmp_path / f"{'long' * 100}.pth")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.pth"]


def test_an_unwritable_folder(tmp_path):
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    user = os.geteuid()
    if user == 0:  # who may write anywhere
        os.seteuid(65534)
    try:
        with pytest.raises(SculptError, match="cannot be written: Permission denied"):
            save(some_field(), folder / "field.pth")
    finally:
        os.seteuid(user)


def test_two_omegas_do_not_fit_the_authors_format(tmp_path):
    with pytest.raises(SculptError, match="safetensors"):
        save(some_field((4, 4, 4), (30.0, 20.0, 10.0)), tmp_path / "field.pth")
    assert not list(tmp_path.iterdir())


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    """While a field is written again and again, every look at the file finds a whole one."""
    path = tmp_path / "field.safetensors"
    fields = [some_field((200, 100 + k)) for k in range(2)]
    save(fields[0], path)
    done = threading.Event()

    def write():
        for turn in range(60):
            save(fields[turn % 2], path)
        done.set()

    writer = threading.Thread(target=write)
    writer.start()
    sizes = set()
    while not done.is_set():
        sizes.add(load(path).network.widths)
    writer.join()
    assert sizes <= {(200, 100), (200, 101)}
    assert [file.name for file in tmp_path.iterdir()] == ["field.safetensors"]


def test_files_have_the_usual_permissions(tmp_path):
    (tmp_path / "usual").touch()
    save(some_field(), tmp_path / "field.pth")
    assert (tmp_path / "field.pth").stat().st_mode == (tmp_path / "usual").stat().st_mode

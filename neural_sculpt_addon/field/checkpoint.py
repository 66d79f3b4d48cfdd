# SPDX-License-Identifier: GPL-3.0-or-later
"""Checkpoints: fields as files and as bytes.

Our own format is safetensors. It has float32 tensors `layers.K.weight` and `layers.K.bias`, the
metadata `format`, `version` and `omegas`, and for a field with detail a uint8 tensor `detail`, the
bytes that `layer_bytes` makes of the coefficients. The version is 1 without detail and 2 with it.

The `.pth` checkpoints of the paper's authors are read, plain ones and those with weight norm, and
written; they hold a network alone. Files come from outside and are untrusted: nothing in them is
executed, sizes are bounded, shapes and numbers are checked.
"""

import io
import json
import math
import os
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from pickle import UnpicklingError  # what torch raises on anything but plain weights
from typing import Any

import safetensors.torch
import torch
from safetensors import SafetensorError
from torch import Tensor

from ..common.errors import SculptError
from ..common.whole_file import write_whole
from .detail import Detail
from .field import Field
from .layer_bytes import layer_from_bytes, layer_to_bytes
from .network import Siren

FORMAT = "neural-sculpt-field"
VERSION, VERSION_WITH_DETAIL = "1", "2"
SUFFIXES = (".safetensors", ".pth")
LARGEST_FILE = 256 << 20  # bytes
LARGEST_HEADER = 256 << 10  # bytes of a header or a pickle, which grow by the number of tensors
MOST_ENTRIES = 1000  # files in an archive
WIDEST_LAYER, DEEPEST = 4096, 16  # units of a layer, and layers
LARGEST_NUMBER = 1e4  # of omegas, weights and biases
STEEPEST_FIELD = 1e30  # bound of |grad f|, as the weights allow it; float32 ends at 3e38

# What readers raise on damaged files, besides their own errors.
DAMAGE = (
    *(ArithmeticError, AssertionError, AttributeError, EOFError, LookupError, MemoryError, OSError),
    *(RuntimeError, TypeError, ValueError, UnpicklingError, SafetensorError, struct.error),
)


def to_bytes(field: Field) -> bytes:
    """The field in our own format (safetensors); the same field always gives the same bytes.

    SculptError when its detail is more than `from_bytes` would read.
    """
    network, tensors = field.network, {}
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        tensors[f"layers.{layer}.weight"] = weight.detach().cpu().contiguous().clone()
        tensors[f"layers.{layer}.bias"] = bias.detach().cpu().contiguous().clone()
    if coefficients := field.detail.to("cpu").coefficients:
        packed = bytearray(layer_to_bytes(coefficients))
        tensors["detail"] = torch.frombuffer(packed, dtype=torch.uint8)
    metadata = {
        "format": FORMAT,
        "version": VERSION_WITH_DETAIL if coefficients else VERSION,
        "omegas": json.dumps([float(omega) for omega in network.omegas]),
        "sign": "negative inside",
    }
    return _sorted_metadata(safetensors.torch.save(tensors, metadata))


def from_bytes(data: bytes) -> Field:
    """The field that `to_bytes` wrote. SculptError when the bytes hold no such field."""
    if LARGEST_HEADER < int.from_bytes(data[:8], "little") <= len(data):
        raise SculptError("This safetensors file holds more tensors than any field.")
    try:
        tensors = safetensors.torch.load(data)
    except DAMAGE as error:
        raise SculptError("This is no readable safetensors file; it is damaged.") from error
    metadata = _metadata(data)
    if metadata.get("format") != FORMAT:
        raise SculptError("This safetensors file holds no neural field of Neural Sculpt.")
    version = metadata.get("version")
    if version not in (VERSION, VERSION_WITH_DETAIL):
        raise SculptError(
            "This field was written in format version {}, this add-on reads version {}."
            " Update Neural Sculpt to open it.",
            f"{version!s:.100}",
            VERSION_WITH_DETAIL,
        )
    detail = _detail(tensors) if version == VERSION_WITH_DETAIL else Detail()
    tensors = _plain(tensors)
    count = len(tensors) // 2
    try:
        omegas = tuple(float(omega) for omega in json.loads(metadata["omegas"]))
        weights = [tensors[f"layers.{layer}.weight"] for layer in range(count)]
        biases = [tensors[f"layers.{layer}.bias"] for layer in range(count)]
    except DAMAGE as error:
        raise SculptError("This field file lacks a part of the network; it is damaged.") from error
    return Field(_checked(weights, biases, omegas), detail)


def _detail(tensors: dict[str, Tensor]) -> Detail:
    """The detail, taken out of `tensors`."""
    packed = tensors.pop("detail", None)
    if packed is None or packed.dtype != torch.uint8 or packed.dim() != 1:
        raise SculptError("This field file lacks its detail; it is damaged.")
    return Detail.of(layer_from_bytes(packed.numpy().tobytes()))


def load(path: str | os.PathLike[str]) -> Field:
    """Read a field from a `.safetensors` or `.pth` file. SculptError when that fails."""
    path = Path(path)
    name = f"{path.name:.100}"
    read = {".safetensors": from_bytes, ".pth": _from_pth}.get(path.suffix.lower())
    if read is None:
        raise SculptError("{} is no field file; choose a .safetensors or .pth file.", name)
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise SculptError("{} is larger than any field file (256 MiB).", name)
        data = path.read_bytes()
    except OSError as error:
        raise SculptError("{} cannot be read: {}.", path, error.strerror) from error
    try:
        return read(data)
    except SculptError as error:
        raise SculptError("{}: {}", name, error) from error


def save(field: Field, path: str | os.PathLike[str]) -> None:
    """Write a field; the suffix chooses our format (.safetensors) or the authors' (.pth).

    The file appears whole or not at all. SculptError when it cannot be written, or when the format
    has no place for the field's detail.
    """
    path = Path(path)
    write = {".safetensors": to_bytes, ".pth": _to_pth}.get(path.suffix.lower())
    if write is None:
        raise SculptError(
            "{}: fields are saved as .safetensors or .pth files.", f"{path.name:.100}"
        )
    write_whole(path, write(field))


def _sorted_metadata(data: bytes) -> bytes:
    """The same file with its metadata, which the library writes in any order, sorted."""
    size = int.from_bytes(data[:8], "little")
    header = json.loads(data[8 : 8 + size])
    header["__metadata__"] = dict(sorted(header["__metadata__"].items()))
    text = json.dumps(header, separators=(",", ":")).encode()
    return data[:8] + text.ljust(size) + data[8 + size :]


def _metadata(data: bytes) -> dict[str, str]:
    """The metadata of a safetensors file that the library has already accepted."""
    size = int.from_bytes(data[:8], "little")
    return json.loads(data[8 : 8 + size]).get("__metadata__", {})


def _from_pth(data: bytes) -> Field:
    """The authors' checkpoint: a dict of architecture and `state_dict`."""
    _bound_archive(data)
    try:
        checkpoint = torch.load(io.BytesIO(data), map_location="cpu", weights_only=True)
    except DAMAGE as error:
        raise SculptError(
            "This is no intact checkpoint of plain weights; nothing in it was executed."
        ) from error
    try:
        if not isinstance(checkpoint, Mapping):
            raise TypeError("no dict")
        state = _plain(checkpoint["state_dict"])
        first, hidden = float(checkpoint["first_omega_0"]), float(checkpoint["hidden_omega_0"])
        count = len({key.split(".")[1] for key in state})
        names = [f"net.{k}.linear" for k in range(count - 1)] + [f"net.{count - 1}"]
        weights = [_plain_weight(state, name) for name in names]
        biases = [state[f"{name}.bias"] for name in names]
    except DAMAGE as error:
        raise SculptError("This checkpoint holds no SIREN network of the authors' form.") from error
    return Field(_checked(weights, biases, (first, *[hidden] * (count - 2))))


def _bound_archive(data: bytes) -> None:
    """Refuse an archive that would unpack to more than a field can hold."""
    if data.count(b"PK\1\2") > MOST_ENTRIES:
        raise SculptError("This checkpoint holds more tensors than any field.")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = archive.infolist()
    except (zipfile.BadZipFile, *DAMAGE) as error:
        raise SculptError("This checkpoint is truncated or damaged.") from error
    if sum(entry.file_size for entry in entries) > LARGEST_FILE:
        raise SculptError("This checkpoint unpacks to more than any field file (256 MiB).")
    if any(e.file_size > LARGEST_HEADER for e in entries if e.filename.endswith(".pkl")):
        raise SculptError("This checkpoint holds more tensors than any field.")


def _plain(tensors: Mapping[str, object]) -> dict[str, Tensor]:
    """The tensors as dense float32. SculptError when they are something else, or too large."""
    plain, size = {}, 0
    for name, tensor in tensors.items():
        if not isinstance(tensor, Tensor) or not tensor.is_floating_point():
            raise SculptError("This network's weights are no floating-point tensors.")
        if tensor.layout is not torch.strided or tensor.is_meta:
            raise SculptError("This network's weights are no plain tensors; save them densely.")
        size += 4 * tensor.numel()  # an expanded tensor is larger here than in its file
        if size > LARGEST_FILE:
            raise SculptError("This network's weights take more than any field's (256 MiB).")
        plain[name] = tensor.float().contiguous()
    return plain


def _plain_weight(state: Mapping[str, Tensor], name: str) -> Tensor:
    """The weight (out, in) of one layer; with weight norm it is g v / |v|, row by row."""
    if f"{name}.weight" in state:
        return state[f"{name}.weight"]
    g, v = state[f"{name}.weight_g"], state[f"{name}.weight_v"]
    if v.dim() != 2 or g.shape != (len(v), 1):
        raise ValueError("weight norm has one g for each row of v")
    return g * v / v.norm(dim=1, keepdim=True)


def _to_pth(field: Field) -> bytes:
    if field.detail.coefficients:
        raise SculptError(
            "The .pth format has no place for detail. Save as .safetensors, sculpt with --solver"
            " network, or choose Consolidate, which fits a plain network to the field."
        )
    network = field.network
    first, *others = network.omegas
    if len(set(others)) > 1:
        raise SculptError(
            "The .pth format has one omega for all inner layers; save as .safetensors instead."
        )
    state = {}
    last = len(network.weights) - 1
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        name = f"net.{layer}.linear" if layer < last else f"net.{layer}"
        state[f"{name}.weight"] = weight.detach().cpu().clone()
        state[f"{name}.bias"] = bias.detach().cpu().clone()
    checkpoint: dict[str, Any] = {
        "in_features": 3,
        "out_features": 1,
        "hidden_features": list(network.widths),
        "outermost_linear": True,
        "first_omega_0": first,
        "hidden_omega_0": others[0] if others else first,
        "weight_norm": False,
        "state_dict": state,
    }
    buffer = io.BytesIO()
    torch.save(checkpoint, buffer)
    return buffer.getvalue()


def _checked(weights: list[Tensor], biases: list[Tensor], omegas: tuple[float, ...]) -> Siren:
    """A Siren of plain tensors whose shapes fit each other and whose numbers are finite."""
    if not 2 <= len(weights) <= DEEPEST:
        raise SculptError("This network has {} layers; a field has 2 to {}.", len(weights), DEEPEST)
    if len(omegas) != len(weights) - 1 or not all(math.isfinite(w) and w > 0 for w in omegas):
        raise SculptError("This network's omega factors do not fit its layers.")
    fan_in = 3
    for layer, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        fan_out = 1 if layer == len(weights) - 1 else bias.numel()
        fits = weight.shape == (fan_out, fan_in) and bias.shape == (fan_out,)
        if not fits or not 1 <= fan_out <= WIDEST_LAYER:
            raise SculptError(
                "This network's layer {} has weights {} and biases {}; a field leads from 3"
                " coordinates to 1 value.",
                layer + 1,
                f"{tuple(weight.shape)!s:.50}",
                f"{tuple(bias.shape)!s:.50}",
            )
        fan_in = fan_out
    if not all(bool(torch.isfinite(tensor).all()) for tensor in (*weights, *biases)):
        raise SculptError("This network's weights hold NaN or infinite numbers; it is damaged.")
    network = Siren(tuple(weights), tuple(biases), omegas)
    if max(*omegas, *(float(tensor.abs().max()) for tensor in network.parameters)) > LARGEST_NUMBER:
        raise SculptError("This network's omegas or weights are beyond 10000; no field has such.")
    if _steepness(network) > STEEPEST_FIELD:
        raise SculptError("This network is steeper than any field; its values could be NaN.")
    return network


def _steepness(network: Siren) -> float:
    """A bound of |grad f|: the product of the layers' largest row sums."""
    factors = (*network.omegas, 1.0)
    rows = (weight.double().abs().sum(dim=1).max() for weight in network.weights)
    return math.prod(omega * float(row) for omega, row in zip(factors, rows, strict=True))

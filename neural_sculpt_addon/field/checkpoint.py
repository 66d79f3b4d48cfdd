# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields as files and as bytes.

Our own format is safetensors: float32 tensors `layers.K.weight`, `layers.K.bias` and the metadata
`format`, `version` and `omegas`. The authors' `.pth` checkpoints (plain and weight norm) are read
and written as well. Files come from outside and are untrusted: nothing in them is executed, sizes
are bounded, shapes and numbers checked.
"""

import io
import json
import math
import os
import struct
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from pickle import UnpicklingError  # what torch raises on anything but plain weights
from typing import Any

import safetensors.torch
import torch
from safetensors import SafetensorError
from torch import Tensor

from ..stroke.errors import SculptError
from .network import Siren

FORMAT = "neural-sculpt-field"
VERSION = 1
SUFFIXES = (".safetensors", ".pth")
LARGEST_FILE = 256 << 20  # bytes
WIDEST, DEEPEST = 4096, 16

# What readers raise on damaged files, besides their own errors.
DAMAGE = (
    *(ArithmeticError, AssertionError, AttributeError, EOFError, LookupError, MemoryError, OSError),
    *(RuntimeError, TypeError, ValueError, UnpicklingError, SafetensorError, struct.error),
)


def to_bytes(network: Siren) -> bytes:
    """The field in our own format (safetensors); the same field always gives the same bytes."""
    tensors = {}
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        tensors[f"layers.{layer}.weight"] = weight.detach().cpu().contiguous()
        tensors[f"layers.{layer}.bias"] = bias.detach().cpu().contiguous()
    metadata = {
        "format": FORMAT,
        "version": str(VERSION),
        "omegas": json.dumps([float(omega) for omega in network.omegas]),
        "sign": "negative inside",
    }
    return _sorted_metadata(safetensors.torch.save(tensors, metadata))


def from_bytes(data: bytes) -> Siren:
    """The field that `to_bytes` wrote. SculptError when the bytes hold no such field."""
    try:
        tensors = _plain(safetensors.torch.load(data))
    except DAMAGE as error:
        raise SculptError("This is no readable safetensors file; it is damaged.") from error
    metadata = _metadata(data)
    if metadata.get("format") != FORMAT:
        raise SculptError("This safetensors file holds no neural field of Neural Sculpt.")
    if metadata.get("version") != str(VERSION):
        raise SculptError(
            f"This field was written in format version {metadata.get('version')}, this add-on reads"
            f" version {VERSION}. Update Neural Sculpt to open it."
        )
    count = len(tensors) // 2
    try:
        omegas = tuple(float(omega) for omega in json.loads(metadata["omegas"]))
        weights = [tensors[f"layers.{layer}.weight"] for layer in range(count)]
        biases = [tensors[f"layers.{layer}.bias"] for layer in range(count)]
    except DAMAGE as error:
        raise SculptError("This field file lacks a part of the network; it is damaged.") from error
    return _checked(weights, biases, omegas)


def load(path: str | os.PathLike[str]) -> Siren:
    """Read a field from a `.safetensors` or `.pth` file. SculptError when that fails."""
    path = Path(path)
    read = {".safetensors": from_bytes, ".pth": _from_pth}.get(path.suffix.lower())
    if read is None:
        raise SculptError(f"{path.name} is no field file; choose a .safetensors or .pth file.")
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise SculptError(f"{path.name} is larger than any field file (256 MiB).")
        data = path.read_bytes()
    except OSError as error:
        raise SculptError(f"{path} cannot be read: {error.strerror}.") from error
    try:
        return read(data)
    except SculptError as error:
        raise SculptError(f"{path.name}: {error}") from error


def save(network: Siren, path: str | os.PathLike[str]) -> None:
    """Write a field; the suffix chooses our format (.safetensors) or the authors' (.pth).

    The file appears whole or not at all. SculptError when it cannot be written.
    """
    path = Path(path)
    write = {".safetensors": to_bytes, ".pth": _to_pth}.get(path.suffix.lower())
    if write is None:
        raise SculptError(f"{path.name}: fields are saved as .safetensors or .pth files.")
    write_whole(path, write(network))


def write_whole(path: Path, data: bytes) -> None:
    """Write `data` to `path` by way of a temporary file beside it. SculptError when that fails."""
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            os.chmod(temporary, 0o666 & ~_umask())
            os.replace(temporary, path)
        except OSError:
            os.unlink(temporary)
            raise
    except OSError as error:
        raise SculptError(
            f"{path} cannot be written: {error.strerror}. Choose another folder or file name."
        ) from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


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


def _from_pth(data: bytes) -> Siren:
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
    return _checked(weights, biases, (first, *[hidden] * (count - 2)))


def _bound_archive(data: bytes) -> None:
    """Refuse an archive that would unpack to more than a field can hold."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
    except (zipfile.BadZipFile, *DAMAGE) as error:
        raise SculptError("This checkpoint is truncated or damaged.") from error
    if size > LARGEST_FILE:
        raise SculptError("This checkpoint unpacks to more than any field file (256 MiB).")


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


def _to_pth(network: Siren) -> bytes:
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
        raise SculptError(f"This network has {len(weights)} layers; a field has 2 to {DEEPEST}.")
    if len(omegas) != len(weights) - 1 or not all(math.isfinite(w) and w > 0 for w in omegas):
        raise SculptError("This network's omega factors do not fit its layers.")
    fan_in = 3
    for layer, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        fan_out = 1 if layer == len(weights) - 1 else bias.numel()
        if weight.shape != (fan_out, fan_in) or bias.shape != (fan_out,) or fan_out > WIDEST:
            raise SculptError(
                f"This network's layer {layer + 1} has weights {tuple(weight.shape)} and biases"
                f" {tuple(bias.shape)}; a field leads from 3 coordinates to 1 value."
            )
        fan_in = fan_out
    if not all(bool(torch.isfinite(tensor).all()) for tensor in (*weights, *biases)):
        raise SculptError("This network's weights hold NaN or infinite numbers; it is damaged.")
    return Siren(tuple(weights), tuple(biases), omegas)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields whose zero sets are known in closed form."""

import numpy as np
import torch

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.network import Siren

FREQUENCIES = np.array([0.5, 1.0, 1.5, 2.0, 2.5])


def siren(*layers, omegas=(1.0,)):
    """A network of (weight, bias) layers, nested lists or arrays."""
    weights, biases = zip(*layers, strict=True)
    return Siren(
        tuple(torch.tensor(np.array(weight), dtype=torch.float32) for weight in weights),
        tuple(torch.tensor(np.array(bias), dtype=torch.float32) for bias in biases),
        tuple(omegas),
    )


def plane(normal=(0.0, 0.0, 1.0), offset=0.0):
    """sin(n . x - offset): negative below a plane; |grad f| = 1 on it."""
    return Field(siren(([normal], [-offset]), ([[1.0]], [0.0])))


def ellipsoid(axes, spare=0, seed=0):
    """(sum (x_i / a_i)^2 - 1) a / 2 with a the mean axis, by cosines fitted to x^2: within 1e-6.

    `spare` more units of random frequencies with weight zero let an edit bend the surface.
    """
    x = np.linspace(-1.1, 1.1, 600)
    basis = np.column_stack([np.cos(np.outer(x, FREQUENCIES)), np.ones_like(x)])
    *parabola, constant = np.linalg.lstsq(basis, x**2, rcond=1e-9)[0]
    scale = np.mean(axes) / 2
    share = scale / np.square(axes)  # (3,)
    random = np.random.default_rng(seed)
    weight = np.concatenate(
        [np.kron(np.eye(3), FREQUENCIES[:, None]), 8 * random.normal(size=(spare, 3))]
    )
    bias = np.append(np.full(3 * len(FREQUENCIES), np.pi / 2), random.uniform(-3, 3, spare))
    last = np.append(np.outer(share, parabola).ravel(), np.zeros(spare))
    return Field(siren((weight, bias), ([last], [constant * share.sum() - scale])))


def ball(radius=0.5, spare=0, seed=0):
    """(|x|^2 - R^2) / (2 R): a sphere on which |grad f| = 1, its gradient radial everywhere."""
    return ellipsoid((radius, radius, radius), spare, seed)


def scaled(field, factor):
    """`factor` times the field: the same zero set, gradients so much smaller."""
    *rest, weight, bias = field.network.parameters
    return Field(field.network.with_parameters([*rest, factor * weight, factor * bias]))


def thin_lens():
    """An ellipsoid 0.1 thick and 1 wide, with |grad f| = 1 at its poles as a distance has."""
    return scaled(ellipsoid((0.5, 0.5, 0.05)), 1 / 7)


def eight_balls():
    """cos(2 pi x) + cos(2 pi y) + cos(2 pi z) + 2: blobs about (+-1/2, +-1/2, +-1/2)."""
    return Field(siren((2 * np.pi * np.eye(3), np.full(3, np.pi / 2)), ([[1.0] * 3], [2.0])))

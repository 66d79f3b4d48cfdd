# SPDX-License-Identifier: GPL-3.0-or-later
"""Growing a network keeps its field."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.grow import grow
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.stroke.errors import SculptError

BOX = np.random.default_rng(0).uniform(-1, 1, (500, 3))


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 40), st.integers(0, 40)), min_size=1, max_size=4))
def test_the_field_stays_the_same(layers):
    network = Siren.random([old for old, _ in layers], 30.0, torch.Generator().manual_seed(1))
    grown = grow(network, [old + new for old, new in layers])
    assert grown.widths == tuple(old + new for old, new in layers)
    np.testing.assert_allclose(values(grown, BOX), values(network, BOX), atol=2e-5)


def test_new_units_of_the_first_layer_are_finer_and_reproducible():
    network = Siren.random((16, 16), 30.0, torch.Generator().manual_seed(1))
    first, second = (grow(network, (64, 16), 1.2, seed=5).weights[0] for _ in range(2))
    assert torch.equal(first, second)
    length = first[16:].norm(dim=1)
    assert length.max() <= 1.2
    assert length.max() > 0.9 > 3**0.5 / 3  # the longest row of a fresh network
    assert torch.equal(first[:16], network.weights[0])


@pytest.mark.parametrize("widths", [(8, 16), (16,), (16, 16, 16)])
def test_networks_do_not_shrink(widths):
    with pytest.raises(SculptError, match="cannot grow"):
        grow(Siren.random((16, 16)), widths)

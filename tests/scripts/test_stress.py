# SPDX-License-Identifier: GPL-3.0-or-later
"""A small share of the quick attacks, and what the runner makes of one that fails."""

import json
from random import Random

import pytest
import stress
from reliability import document, mutations

# Some defects of readers are known by larger counts; these are free of them.
SHARES = {"enabling": 3, "frames_to_client": 100, "frames_to_worker": 20}


@pytest.mark.parametrize("name", SHARES)
@pytest.mark.long
def test_a_share_of_the_attack_breaks_nothing(name):
    result = stress.run(name, SHARES[name], seed=1)
    assert result["failures"] == []


def test_the_same_seed_gives_the_same_bytes():
    data = bytes(range(256))
    first, second = ([mutations.mutated(data, Random(n)) for n in range(50)] for _ in range(2))
    assert first == second
    assert len(set(first)) > 40


def test_an_attack_whose_process_ends_has_failed(monkeypatch):
    monkeypatch.setattr(stress, "attack", lambda name: type("A", (), {"ROLE": "worker"}))
    result = stress.run("no_such_attack", 1, seed=1)
    assert "did not finish" in result["failures"][0]


def test_the_table_has_a_row_for_each_attack(tmp_path, monkeypatch):
    monkeypatch.setattr(document, "DOCUMENT", tmp_path / "reliability.md")
    row = {"tries": 7, "lost": 0, "failures": [], "seconds": 3, "versions": {"torch": "2"}}
    record = {
        "one": {
            **row,
            "date": "2030-01-01",
            "machine": "M",
            "commit": "abc",
            "seed": 1,
            "share": 1.0,
        }
    }
    document.write(json.loads(json.dumps(record)), {"one": "Does so.", "two": "Else."})
    text = (tmp_path / "reliability.md").read_text()
    assert "| one | Does so. | 7 | lost 0 | 0 |" in text
    assert "| two | Else. | not recorded | | |" in text
    assert "| one | 2030-01-01 | M | torch 2 | abc | 3 |" in text

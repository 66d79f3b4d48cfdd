# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables as text, finished rows that stay, and the plan that a run tells."""

import json

import pytest
from paper.run import missing_of
from paper.settings import FULL, QUICK
from paper.tables.table import Table
from paper.work import Task, Work, plan

from neural_sculpt_addon.common.errors import SculptError

TABLE = Table(
    "t", "Table 9: things", ("shape", "a", "b"), (("ball", 1.23456, 3), ("cube", None, 12345.6))
)


def quiet(_text):
    """Say nothing."""


def test_a_table_as_markdown():
    assert TABLE.markdown() == (
        "## Table 9: things\n\n"
        "| shape | a | b |\n| --- | --- | --- |\n| ball | 1.23 | 3 |\n| cube |  | 12346 |\n"
    )


def test_a_table_as_csv_keeps_all_digits():
    assert TABLE.csv() == "shape,a,b\nball,1.23456,3\ncube,,12345.6\n"


def test_finished_rows_are_not_made_again(tmp_path):
    made = []

    def task(key):
        return Task(key, 60.0, lambda: made.append(key) or {"key": key})

    one, two = task("one"), task("two")
    assert Work(tmp_path, {"cores": 2}).do([one], quiet) == {"one": {"key": "one"}}
    said = []
    rows = Work(tmp_path, {"cores": 2}).do([one, two], said.append)
    assert rows == {"one": {"key": "one"}, "two": {"key": "two"}}
    assert made == ["one", "two"]
    assert said[0].startswith("1 of 2 rows are finished; the others take about 60 seconds")


def test_rows_that_are_not_finished_are_left_out(tmp_path):
    one, two = Task("one", 60.0, lambda: {"x": 1}), Task("two", 60.0, lambda: {"x": 2})
    work = Work(tmp_path, {})
    work.do([two], quiet)
    assert work.rows([one, two]) == {"two": {"x": 2}}


def test_the_page_tells_how_many_rows_are_missing():
    tasks = [Task(key, 1.0, dict) for key in ("table2-a-0", "table2-b-0", "table3-8", "figure-x")]
    told = missing_of(tasks, {"table2-a-0": {}, "figure-x": {}})
    assert told == "1 of 2 rows of table2, 1 of 1 rows of table3 are missing"


def test_a_row_that_fails_leaves_the_others(tmp_path):
    def fail():
        raise RuntimeError("no memory")

    tasks = [Task("good", 1, lambda: {"x": 1}), Task("bad", 1, fail)]
    with pytest.raises(RuntimeError, match="no memory"):
        Work(tmp_path, {}).do(tasks, quiet)
    assert [p.name for p in tmp_path.glob("*.json") if p.name != "about.json"] == ["good.json"]


def test_rows_of_another_machine_are_refused(tmp_path):
    Work(tmp_path, {"processor": "one"}).do([], quiet)
    with pytest.raises(SculptError, match="another machine"):
        Work(tmp_path, {"processor": "two"})


def test_one_method_is_measured_anew_and_the_others_stay(tmp_path):
    def task(number):
        def make(names):
            return {"floor": number, "methods": {name: number for name in names}}

        alone = {"a": lambda: make(["a"]), "b": lambda: make(["b"])}
        return Task("compared", 1, lambda: make(["a", "b"]), alone)

    def lone(number):
        return Task("lone", 1, lambda: {"x": number}, {"b": lambda: {"x": number}})

    def timed(number):
        return Task("timed", 1, lambda: {"methods": {"a": number, "b": number}})

    work = Work(tmp_path, {})
    work.do([task(1), lone(1), timed(1)], quiet)
    missing = Task("missing", 1, dict, {"b": dict})
    rows = work.measure_anew([task(2), lone(2), timed(2), missing], "b", quiet)
    assert rows == {
        "compared": {"floor": 2, "methods": {"a": 1, "b": 2}},
        "lone": {"x": 2},
        "timed": {"methods": {"a": 1, "b": 1}},
    }
    with pytest.raises(SculptError, match="No finished row compares c"):
        work.measure_anew([task(3)], "c", quiet)


def test_rows_that_are_kept_are_taken_under_the_same_conditions(tmp_path):
    record, tasks = tmp_path / "rows.json", [Task(key, 1, lambda: {"x": 1}) for key in "ab"]
    work = Work(tmp_path / "first", {"cores": 2})
    work.keep(record, work.do(tasks, quiet))
    assert json.loads(record.read_text())["rows"] == {"a": {"x": 1}, "b": {"x": 1}}
    other = Work(tmp_path / "other", {"cores": 4})
    other.take(record)
    assert other.rows(tasks) == {}
    again = Work(tmp_path / "again", {"cores": 2})
    again.do([Task("a", 1, lambda: {"x": 2})], quiet)
    again.take(record)
    assert again.rows(tasks) == {"a": {"x": 2}, "b": {"x": 1}}


def test_the_plan_tells_hours():
    tasks = [Task(str(number), 3600.0, dict) for number in range(3)]
    assert "3.0 hours" in plan(4, tasks)
    assert plan(4, []) == "4 of 4 rows are finished."


def test_settings_survive_json_and_leave_out_shapes():
    assert json.loads(json.dumps(FULL.to_json())) == FULL.to_json()
    some = FULL.without(["bunny", "frog"])
    assert "bunny" not in some.shapes + some.timed_shapes and "sphere" in some.shapes
    assert set(QUICK.points) <= set(FULL.points)

"""The speed table has all its rows; the timings themselves are not tested here."""

import pytest
import table


def test_every_row_can_be_measured(monkeypatch, tmp_path):
    def call_once(*calls, rounds=1, repeats=1):
        assert isinstance(repeats, int) or len(repeats) == len(calls)
        for call in calls:
            call()
        return [1e-4] * len(calls)

    monkeypatch.setattr(table, "interleaved", call_once)
    monkeypatch.setattr(table, "import_seconds", lambda: 0.1)
    monkeypatch.setattr(table, "SIZES", (1, 4))
    monkeypatch.setattr(table, "COMMON_SIZE", 4)
    monkeypatch.setattr(table, "ROUND", 16)
    monkeypatch.setattr(table, "EPISODE", 2)
    monkeypatch.setattr(table, "PEER_ENVS", 2)
    rows = list(table.rows(tmp_path / "rates.png"))
    assert [len(row) for row in rows] == [3] * 23
    assert rows[-1] == ("`import lgmd_gym`", "0.10 s", "")
    names = [row[0] for row in rows]
    assert {
        "engine, worlds, 4 environments, 2 threads",
        "engine, random levels, 4 environments, 1 thread",
    } <= set(names)
    assert (tmp_path / "rates.png").stat().st_size > 5_000


def test_shares_of_a_step_add_up(monkeypatch):
    monkeypatch.setattr(table, "ROUND", 32)
    shares = table.shares("laboratory", 4)
    assert sum(shares) == pytest.approx(1.0)
    assert shares[0] > 0.1  # camera
    assert shares[1] > 0.1  # neuron


def test_repeats_per_function():
    calls = []
    table.interleaved(lambda: calls.append("a"), lambda: calls.append("b"), rounds=1, repeats=[1, 2])
    assert calls == ["a", "b", "b"] * 2

"""The speed table has all its rows; the timings themselves are not tested here."""

import table


def test_every_row_can_be_measured(monkeypatch):
    def call_once(*calls, rounds=1, repeats=1):
        for call in calls:
            call()
        return [1e-4] * len(calls)

    monkeypatch.setattr(table, "interleaved", call_once)
    monkeypatch.setattr(table, "import_seconds", lambda: 0.1)
    rows = list(table.rows())
    assert [len(row) for row in rows] == [3] * 8
    assert rows[-1] == ("`import lgmd_gym`", "0.10 s", "")

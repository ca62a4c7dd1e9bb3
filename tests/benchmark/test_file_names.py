"""Names of the files of a run folder."""

from itertools import product

import pytest

from lgmd_gym.benchmark.run_folder import case_name, series_name


@pytest.mark.parametrize(
    ("agent", "condition", "name"),
    [
        ("stopping-zone", "clear", "quick_CCRs_v10__stopping-zone__seed3"),
        ("policy:all-round", "fog", "quick_CCRs_v10__policy_all-round__seed3__fog"),
        ("my-rule:gain=2,floor=1", "clear", "quick_CCRs_v10__my-rule_gain=2_floor=1__seed3"),
    ],
)
def test_usual_names_have_no_digest(agent, condition, name):
    assert series_name((agent, "quick/CCRs/v10", 3, condition)) == name


def test_names_differ_for_all_keys():
    def texts(longest):
        return ["".join(text) for size in range(1, longest + 1) for text in product("a_/:,", repeat=size)]

    keys = [*product(texts(3), texts(3), (0,), ("clear",)), ("a", "a", 0, "fog"), ("a", "a", 1, "clear")]
    assert len({series_name(key) for key in keys}) == len(keys)
    cases = list(product(texts(4), ("clear", "fog")))
    assert len({case_name(*case) for case in cases}) == len(cases)


def test_long_and_undecodable_paths_give_short_names():
    paths = [f"policy:{'é' * 300}/{number}\udcff.zip" for number in range(3)]
    names = {series_name((path, "quick/CCRs/v10", 0, "clear")) for path in paths}
    assert len(names) == 3
    assert max(len(name.encode()) for name in names) < 250

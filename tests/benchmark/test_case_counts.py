"""The numbers of cases of the suites against those of the protocol documents."""

from collections import Counter

import pytest

from lgmd_gym.benchmark.suites import SUITES

# Cells of the OpenSCENARIO variation files of Euro NCAP 2023 and 2026, with the names of the files. 2023 has
# no file of CCCscp (30 cells of the test protocol), and a single file for each turn of CPTA to the near side.
CAR_TO_CAR_2023 = {"CCRs": 45, "CCRs_FCW": 30, "CCRm": 55, "CCRb": 4, "CCFtap": 9, "CCFhos": 2, "CCFhol": 2}
VULNERABLE_2023 = {
    "CPNA": 11 + 11, "CPFA": 11, "CPNCO": 11, "CPLA": 7 + 9, "CPTA": 3 + 3 + 1 + 1, "CPRA": 2 + 6, "CBNA": 11,
    "CBNAO": 11, "CBFA": 11, "CBLA": 7 + 8, "CMFtap": 9,
}  # fmt: skip
STANDARD_2026 = {
    "CCRs": 25, "CCRs_FCW": 15, "CCRm": 55, "CCRb": 30, "CCCscp": 50, "CCFtap": 9, "CCFhos": 18, "CMRs": 15,
    "CMRs_FCW": 9, "CMRb": 18, "CMCscp": 50, "CMFtap": 9, "CPNA": 36, "CPFA": 12, "CPNCO": 12, "CPLA": 12,
    "CPLA_FCW": 8, "CBNA": 12, "CBNAO": 12, "CBFA": 12, "CBLA": 5, "CBLA_FCW": 4,
}  # fmt: skip
EXTENDED_2026 = {
    "CCRs": 10, "CCRs_FCW": 6, "CCRm": 22, "CCRb": 47, "CCCscp": 16, "CCFtap": 7, "CCFhos": 14, "CMRs": 10,
    "CMRs_FCW": 6, "CMRb": 37, "CMCscp": 16, "CMFtap": 7, "CPNA": 24, "CPFA": 48, "CPNCO": 24, "CPLA": 36,
    "CPLA_FCW": 24, "CBNA": 18, "CBNAO": 18, "CBFA": 18, "CBLA": 15, "CBLA_FCW": 12,
}  # fmt: skip
COUNTS = {
    "ncap2023": CAR_TO_CAR_2023 | {"CCCscp": 30},
    "ncap2023-vru": VULNERABLE_2023,
    "ncap2026": STANDARD_2026,
    "ncap2026-extended": EXTENDED_2026,
    "r152": {"CCRs": 4, "CCRm": 2},
    "r152-vru": {"CPNA": 4, "CBNA": 4},
    "fmvss127": {"CCRs": 8, "CCRm": 5, "CCRb": 8},
    # 49 CFR 571.127, table 2 to S8.1.1, in steps of 10 km/h: right 25 and 50 %, left, obstructed, standing
    # and along the path; with the lower and the upper beam right 50 %, standing and along the path.
    "fmvss127-pedestrian": {"CPNA": 6 + 3 * 6, "CPFA": 6, "CPNCO": 5, "CPLA": 3 * (6 + 7)},
}


@pytest.mark.parametrize("suite", COUNTS)
def test_case_counts_match_the_documents(suite):
    names = [case.family + ("_FCW" if case.fcw_driver else "") for case in SUITES[suite].cases]
    assert Counter(names) == COUNTS[suite]
    assert len({case.name for case in SUITES[suite].cases}) == len(names)
    unnamed = {(case.family, case.fcw_driver, *case.arguments) for case in SUITES[suite].cases}
    assert len(unnamed) == len(names)

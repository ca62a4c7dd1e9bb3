"""OpenSCENARIO XML 1.0 to 1.3: files as suites, a comparison with their intent, and export of cases.

XML is parsed with the standard library's expat, which reports lines. Packages for OpenSCENARIO and OpenDRIVE
are not used: scenariogeneration only writes files and needs SciPy, pyxodr needs matplotlib and Shapely, and
the ASAM checkers (asam-qc-openscenarioxml, asam-qc-opendrive) find faults but resolve no positions.

Every function that reads an element raises ValueError for what is missing, unknown or not supported; the
message begins with the file and line.
"""

from lgmd_gym.benchmark.extensions import provide
from lgmd_gym.openscenario.reader import SUFFIX, read, read_all

__all__ = ["read", "read_all"]

provide(SUFFIX, read_all)

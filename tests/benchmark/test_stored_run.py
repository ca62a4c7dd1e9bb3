"""Reading of stored time series."""

import numpy as np
import pytest

from lgmd_gym.benchmark.run_folder import read_series


@pytest.mark.parametrize("kind", ["cut off", "changed", "folder"])
def test_damaged_series_are_refused_in_one_line(tmp_path, kind):
    file = tmp_path / "traces" / "a.npz"
    file.parent.mkdir()
    assert read_series(tmp_path, "a") is None
    np.savez_compressed(file, time=np.arange(1000.0))
    assert read_series(tmp_path, "a")["time"].shape == (1000,)
    data = bytearray(file.read_bytes())
    data[60:90] = bytes(30)
    file.unlink()
    if kind == "folder":
        file.mkdir()
    else:
        file.write_bytes(data if kind == "changed" else data[:100])
    with pytest.raises(ValueError, match=r"a\.npz' is damaged; remove it to leave its episode out$"):
        read_series(tmp_path, "a")

"""The script docs/examples/stabilisation.py runs and prints plausible results."""

from support.examples import load


def test_stabilisation(capsys):
    drives = load("stabilisation").main(["--worlds", "1", "--conditions", "clear", "--frames", "40"])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(" | ")[0] for line in lines[2:-1]] == [f"| {name}" for name in drives]
    body, image = (float(lines[2].split(" | ")[k]) for k in (1, 2))
    assert 0.0 < image < 0.15 * body
    assert lines[-1].endswith("µs per registration")

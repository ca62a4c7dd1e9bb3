"""Tests of `lgmd-gym doctor`: no fault on a working installation, and a finding for every injected fault."""

import pytest
from av.codec.codec import UnknownCodecError

from lgmd_gym.cli import doctor
from lgmd_gym.cli import main as cli
from lgmd_gym.cli.console import make_console


def faults(findings):
    return [item for item in findings if item.state == doctor.FAULT]


def test_a_working_installation_has_no_fault(capsys, monkeypatch):
    monkeypatch.setattr(doctor, "SELF_TEST_S", 0.2)
    assert cli.run(["doctor"]) == 0
    output = " ".join(capsys.readouterr().out.split())
    for words in ("numba 0", "__pycache__", "ffmpeg", "m before the target", "camera frames/s"):
        assert words in output
    assert "fault" not in output


def test_messages_are_wrapped_and_paths_are_not(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    path = "/" + "folder/" * 15
    finding = doctor.Finding("check", doctor.NOTE, "name 1.0, " * 20, f"write to {path} " + "or so " * 20)
    doctor.print_findings([finding], make_console())
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) > 6
    assert all(len(line) <= 80 or line.strip() == path for line in lines)
    assert path in "".join(lines)


@pytest.mark.parametrize(
    ("requirement", "message"),
    [("numpy>=99", "requires >=99"), ("no-such-package-here>=1", "no-such-package-here is missing")],
)
def test_an_unmet_requirement_is_a_fault(requirement, message, monkeypatch):
    listed = [requirement, 'torch>=99; extra == "train"']
    monkeypatch.setattr("importlib.metadata.requires", lambda package: listed)
    (fault,) = faults(doctor.check_versions())
    assert message in fault.message
    assert "pip install" in fault.fix


def test_a_missing_codec_is_a_fault(monkeypatch):
    def unknown_encoder(*args, **kwargs):
        raise UnknownCodecError("libx264")

    monkeypatch.setattr("lgmd_gym.clips.VideoWriter._open", unknown_encoder)
    (fault,) = faults(doctor.run_check("video"))
    assert "libx264" in fault.message
    assert fault.fix == "pip install --force-reinstall av"


def test_an_unwritable_kernel_cache_is_a_fault(monkeypatch):
    monkeypatch.setattr(doctor, "_cache_folder", lambda module: "/proc/nowhere")
    (fault,) = faults(doctor.check_cache())
    assert "set NUMBA_CACHE_DIR" in fault.fix


def test_kernels_that_are_not_compiled_are_a_fault(monkeypatch):
    from lgmd_gym.kernels import threads

    monkeypatch.setattr(threads.config, "DISABLE_JIT", 1)
    (finding,) = doctor.check_cache()
    assert (finding.state, finding.fix) == ("fault", "unset NUMBA_DISABLE_JIT")
    with pytest.raises(ValueError, match="NUMBA_DISABLE_JIT must be unset for environments and cameras"):
        threads.check_compiling()


def test_contact_with_the_rule_is_a_fault(monkeypatch):
    monkeypatch.setattr(doctor, "SELF_TEST_S", 0.01)
    monkeypatch.setattr(doctor, "_run_approach", lambda name: ((True, 0.0), 10))
    (fault,) = faults(doctor.check_simulation())
    assert "got contact and contact" in fault.message


def test_different_results_for_one_seed_are_a_fault(monkeypatch):
    gaps = iter(range(1000))
    monkeypatch.setattr(doctor, "SELF_TEST_S", 0.01)
    monkeypatch.setattr(
        doctor, "_run_approach", lambda name: ((name == "no-brake", float(next(gaps, 0))), 10)
    )
    (fault,) = faults(doctor.check_simulation())
    assert "two different results" in fault.message


def test_a_fault_gives_exit_code_one(monkeypatch, capsys):
    def fail():
        raise OSError("no space left on [disk]")

    monkeypatch.setattr(doctor, "CHECKS", {"disk": fail})
    assert cli.run(["doctor"]) == 1
    assert "no space left on [disk]" in capsys.readouterr().out

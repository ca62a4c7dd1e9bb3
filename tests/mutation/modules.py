"""Modules of the mutation test: their sources and the tests that must notice a mutant."""

from typing import NamedTuple


class Module(NamedTuple):
    """Sources, their tests, and functions that cannot run without compilation."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]
    skipped: tuple[str, ...] = ()


def _under(folder: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{folder}/{name}.py" for name in names)


_HAND = ("test_motion_by_hand", "test_ego_by_hand", "test_contact_by_hand", "test_episode_end")
_FAMILIES = ("rear", "crossing", "turning", "adjacent", "obstacle")
# Kernels of the ground and of light that only whole frames show.
_SEEN = (
    "add_sky_veil",
    "aim_beam",
    "light_at",
    "row_air",
    "row_slope",
    "through_air",
    "veil_at",
    "_ground_light",
    "_surface_of",
    "_without_traces",
    "add_road",
    "add_level_polygon",
    "add_ground_polygon",
    "add_outline",
    "shade_row",
    "_add_cracks",
    "_add_seams",
    "_add_slabs",
    "_add_stones",
    "_add_tufts",
    "_noise",
    "_ripmap",
    "add_features",
    "ground_texture",
)
MODULES = {
    "reward": Module(("envs/reward.py",), ("tests/envs/test_formulas.py",)),
    "info": Module(
        ("envs/info.py", "envs/surrogate_safety.py"),
        ("tests/envs/test_formulas.py",),
        # Tests of these, which only traffic uses, step environments.
        ("required_deceleration", "predicted_contact", "outline_after"),
    ),
    "dynamics": Module(
        _under(
            "envs/dynamics",
            "longitudinal",
            "brake",
            "bodies",
            "path",
            "script",
            "units",
            "episode",
        ),
        _under("tests/envs", *_HAND, "test_path", "test_formulas", "test_drawn_brake"),
        ("__deepcopy__", "DelayLine", "SpeedProfile", "step_environment"),
    ),
    "contact": Module(_under("envs/dynamics", "contact"), ("tests/envs/test_contact_by_hand.py",)),
    "scenarios": Module(
        _under("envs/families", "adjacent", "crossing", "obstacles", "rear", "scenario", "turning"),
        (*_under("tests/envs", *(f"test_{name}_scenarios" for name in _FAMILIES), "test_scenario_data"),),
        ("_time_to_cover",),
    ),
    "metrics": Module(("lgmd_gym/benchmark/metrics.py",), ("tests/benchmark/test_formulas.py",)),
    "statistics": Module(
        (*_under("lgmd_gym/statistics", "intervals", "bootstrap"), "lgmd_gym/benchmark/analysis/compare.py"),
        _under("tests/benchmark", "test_formulas", "test_statistics", "test_effective_size"),
        (
            *(
                "compare_runs",
                "compare_agents",
                "read_case_rows",
                "_agent_pairs",
                "count_interval",
                "_stretch",
            ),
            *(
                "comparison_table",
                "change_text",
                "difference_figure",
                "_plot_differences",
                "_comparison_label",
            ),
        ),
    ),
    "neuron": Module(("lgmd_gym/neuron/scalars.py",), ("tests/neuron/test_boundaries.py",)),
    "camera": Module(
        (
            *_under("lgmd_gym/camera", "pinhole", "pose"),
            *_under("lgmd_gym/camera/render", "light", "ground", "texture"),
        ),
        tuple(f"tests/camera/test_{name}_by_hand.py" for name in ("geometry", "glare", "ground", "markings")),
        ("noise_start", "fixed_line", "_fixed", "sample", *_SEEN),
    ),
}

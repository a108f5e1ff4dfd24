"""Pytest plugin: fixtures and assertions for code that uses this package.

It has fixtures that make scans, skills, stations and flights (``aerial_...``) and assertions on
flights. Switch it on in your ``conftest.py``::

    pytest_plugins = ["drake_aerial.testing"]

and test a controller of your own in five lines::

    from drake_aerial.testing import assert_completed, assert_taut, assert_tracks

    def test_my_controller_holds_a_box_still(aerial_flight):
        trial = aerial_flight([[0.0, 0.0]], controller=MyController, trajectory="hover")
        assert_completed(trial)
        assert_taut(trial)
        assert_tracks(trial, rmse=0.05)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from drake_aerial.choices import Belief
from drake_aerial.errors import InputError

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud
    from drake_aerial.plant.payload import Payload
    from drake_aerial.simulation.station import TransportStation
    from drake_aerial.simulation.suspended_payload import SuspendedPayload
    from drake_aerial.simulation.trial_result import TrialResult
    from drake_aerial.skill.contact_skill import ContactSkill


def contacts_from_above(payload: Payload, places: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return the highest points of a payload's surface at horizontal positions.

    Parameters
    ----------
    payload : Payload
    places : (n, 2)
        x and y in the scan's frame S, z up [m].

    Returns
    -------
    Points (n, 3) in S [m] and outward normals (n, 3).

    Raises
    ------
    InputError
        If the payload has no surface at a place.
    """
    import open3d as o3d

    from drake_aerial.geometry import transform

    vertices = transform(payload.X_SP, payload.vertices)
    xy = np.asarray(places, float).reshape(-1, 2)
    # The ray caster has single precision: start close.
    height = float(vertices[:, 2].max()) + 0.1
    scene: Any = o3d.t.geometry.RaycastingScene()
    tensor: Any = o3d.core.Tensor
    scene.add_triangles(vertices.astype(np.float32), payload.faces.astype(np.uint32))
    down = np.tile([0.0, 0.0, -1.0], (len(xy), 1))
    rays = np.hstack([xy, np.full((len(xy), 1), height), down])
    hit = scene.cast_rays(tensor(rays.astype(np.float32)))
    depth, normals = (
        hit["t_hit"].numpy().astype(float),
        hit["primitive_normals"].numpy().astype(float),
    )
    for place, reach in zip(xy, depth, strict=True):
        if not np.isfinite(reach):
            raise InputError(f"payload {payload.name!r} has no surface at {place.tolist()} m")
    normals *= np.where(normals[:, 2:] < 0.0, -1.0, 1.0)
    return np.column_stack([xy, height - depth]), normals / np.linalg.norm(
        normals, axis=1, keepdims=True
    )


def _suspended(payload: Payload | str, places: ArrayLike) -> SuspendedPayload:
    from drake_aerial.plant.payload import Payload
    from drake_aerial.simulation.suspended_payload import SuspendedPayload

    if not isinstance(payload, Payload):
        payload = Payload.read(payload)
    return SuspendedPayload.from_contacts(payload, *contacts_from_above(payload, places))


@pytest.fixture(scope="session")
def aerial_skill() -> Callable[..., ContactSkill]:
    """``aerial_skill(name_or_file="flat")``: a skill, learnt once for all tests of a run."""
    from functools import lru_cache

    from drake_aerial.named_inputs import read_skill

    @lru_cache
    def skill(name: str = "flat") -> ContactSkill:
        return read_skill(name)

    return skill


@pytest.fixture(scope="session")
def aerial_scan() -> Callable[..., PointCloud]:
    """``aerial_scan(payload="box_68x68x28", viewpoint=None, noise=0.0, seed=0)``: a synthetic scan.

    The scan covers the whole surface, or, with a `viewpoint` (3,) [m], the part that a depth camera
    there sees. `noise` [m] is per coordinate, or along the camera's rays.
    """

    def scan(
        payload: str = "box_68x68x28",
        viewpoint: ArrayLike | None = None,
        noise: float = 0.0,
        seed: int = 0,
    ) -> PointCloud:
        from drake_aerial.cloud.partial_views import partial_view
        from drake_aerial.named_inputs import read_scan
        from drake_aerial.plant.payload import Payload

        rng = np.random.default_rng(seed)
        if viewpoint is None:
            cloud = read_scan(payload)
            return cloud.with_noise(noise, rng) if noise > 0.0 else cloud
        mesh = Payload.read(payload).to_trimesh()
        return partial_view(mesh, np.asarray(viewpoint, float), noise=noise, rng=rng)

    return scan


@pytest.fixture
def aerial_station() -> Callable[..., TransportStation]:
    """``aerial_station(places, payload="box_68x61x28", controller=None, parameters=None)``.

    It returns a transport station. The contacts are the highest points at the horizontal `places`
    (n, 2) [m]. `controller` is a LeafSystem; without one the station exports the ports for it.
    """

    def station(
        places: ArrayLike = ((0.0, 0.0),), payload: Payload | str = "box_68x61x28", **options: Any
    ) -> TransportStation:
        from drake_aerial.simulation.station import make_transport_station

        held = _suspended(payload, places)
        return make_transport_station(held.payload, held.p_LC, held.normal_L, **options)

    return station


@pytest.fixture
def aerial_flight() -> Callable[..., TrialResult]:
    """``aerial_flight(places, payload="box_68x61x28", seed=0, **options)``: a flight's result.

    The contacts are the highest points at the horizontal `places` (n, 2) [m]. The options are the
    fields of `FlightOptions`, with the belief "true" by default. `controller` may be your own
    function or class, which takes the believed `PayloadModelParameters`.
    """

    def flight(
        places: ArrayLike = ((0.0, 0.0),),
        payload: Payload | str = "box_68x61x28",
        *,
        seed: int = 0,
        belief: Belief = "true",
        **options: Any,
    ) -> TrialResult:
        from drake_aerial.simulation.flight import Flight
        from drake_aerial.simulation.flight_options import FlightOptions

        held = _suspended(payload, places)
        return Flight(held, FlightOptions(belief=belief, **options)).run(seed)

    return flight


def _aloft(trial: TrialResult, phase: str | None) -> np.ndarray:
    """Return which samples (T,) count: those of one phase, or all after the lift."""
    number = np.asarray(trial.series["phase"]).astype(int)
    if phase is None:
        ground = [
            i
            for i, name in enumerate(trial.phase_names)
            if name in ("ground", "tensioning", "lifting")
        ]
        return ~np.isin(number, ground)
    if phase not in trial.phase_names:
        names = ", ".join(trial.phase_names)
        raise InputError(f"`phase` must be one of {names}, got {phase!r}")
    return number == trial.phase_names.index(phase)


def assert_completed(trial: TrialResult) -> None:
    """Fail unless the flight reached the end of its trajectory."""
    outcome, reason = trial.metrics["outcome"], trial.metrics.get("outcome_reason")
    assert outcome == "completed", f"the flight {outcome}: {reason}"


def assert_tracks(
    trial: TrialResult,
    *,
    rmse: float | None = None,
    largest: float | None = None,
    phase: str | None = None,
) -> None:
    """Fail unless the distance from the reference path is within limits.

    Parameters
    ----------
    trial : TrialResult
    rmse, largest : float, optional
        Bounds of the root mean square and of the largest distance from the reference [m].
    phase : str, optional
        The phase that counts; by default all after the lift.
    """
    part = _aloft(trial, phase)
    assert part.any(), f"the flight never reached {phase or 'the phases after the lift'}"
    error = np.linalg.norm(
        trial.series["payload_position"] - trial.series["reference_position"], axis=1
    )[part]
    if rmse is not None:
        measured = float(np.sqrt(np.mean(error**2)))
        assert measured <= rmse, (
            f"root mean square distance from the path is {measured:.4f} m, limit {rmse:g} m"
        )
    if largest is not None:
        assert error.max() <= largest, (
            f"largest distance from the path is {error.max():.4f} m, limit {largest:g} m"
        )


def assert_taut(trial: TrialResult, *, fraction: float = 0.0, phase: str | None = None) -> None:
    """Fail if a cable was slack for more than a fraction of the time.

    The time counts in one phase, or, by default, in all phases after the lift.
    """
    part = _aloft(trial, phase)
    slack = (np.asarray(trial.series["tension"])[part] <= 1e-3).mean(axis=0)
    worst = int(np.argmax(slack))
    assert slack[worst] <= fraction, (
        f"cable {worst + 1} was slack for {100 * slack[worst]:.1f} % of the time, "
        f"limit {100 * fraction:g} %"
    )


def assert_tension_below(trial: TrialResult, limit: float) -> None:
    """Fail if a cable's tension exceeded `limit` [N]."""
    tension = np.asarray(trial.series["tension"])
    cable = int(np.argmax(tension.max(axis=0)))
    largest = float(tension[:, cable].max())
    assert largest <= limit, (
        f"tension of cable {cable + 1} reached {largest:.3f} N, limit {limit:g} N"
    )

"""Factors of the contact likelihood J, with analytic gradients (docs/method.md).

A factor maps the n grippers X_NG of one configuration, in the canonical frame N, to its logarithm
and its gradients by positions p (n, 3) [1/m] and by rotation vectors w (n, 3) [1/rad] of the
perturbed rotations exp(w) R_NG.
"""

from collections.abc import Callable

import numpy as np

from drake_aerial.contacts.likelihood.contact_likelihood import SMALLEST_SCALE, ContactLikelihood
from drake_aerial.contacts.likelihood.formation_frame import (
    FormationFrame,
    FormationFrames,
    about_z,
)
from drake_aerial.contacts.likelihood.query_density import Query
from drake_aerial.density import kernels
from drake_aerial.geometry import (
    Array,
    Pose,
    axis_of,
    cross,
    quat_about_axis,
    quat_conjugate,
    quat_multiply,
)

Factor = Callable[[Pose], tuple[float, Array, Array]]

_Z = np.array([0.0, 0.0, 1.0])


class ConfigurationFactor:
    """log H, and for several grippers the log of the prior of the formation's scale.

    Parameters
    ----------
    likelihood : ContactLikelihood
        Likelihood with the configuration model and the prior.
    frames : FormationFrames
        Formation frames of its configuration model.
    """

    def __init__(self, likelihood: ContactLikelihood, frames: FormationFrames):
        self._likelihood, self._model, self._frames = likelihood, likelihood.configuration, frames
        n, sigma_q = len(self._model), self._model.sigma_q
        rotation = (
            kernels.axis_log_norm(sigma_q) if self._model.axial else kernels.theta_log_norm(sigma_q)
        )
        self._log_norm = n * (
            kernels.gaussian_log_norm(3, self._model.sigma_p)
            + np.log(self._model.vertical)
            + rotation
        )

    def __call__(self, X_NG: Pose) -> tuple[float, Array, Array]:
        """Return the logarithm and its gradients by p and w, (n, 3) each."""
        model, prior = self._model, self._likelihood.prior
        frame = self._frames(X_NG)
        offset, reference = X_NG.p - frame.origin, frame.turned(model.X_FG.p)
        scale = float(self._likelihood.scale(X_NG, frame.origin, np.asarray(frame.yaw)))
        weight = np.array([1.0, 1.0, model.vertical**2])
        trust = weight / model.sigma_p**2

        miss = offset - scale * reference
        value = self._log_norm - 0.5 * float(np.sum(trust * miss**2))
        by_offset = -trust * miss
        by_yaw = scale * float(np.sum(trust * miss * about_z(reference)))
        log_theta, by_w = self._rotation(X_NG.q, frame)
        value += log_theta
        # Turning the reference is turning the grippers the other way.
        by_yaw -= float(by_w[:, 2].sum())

        if len(model) > 1:
            log_ratio = np.log(scale) - prior.log_mean
            value -= 0.5 * (log_ratio / prior.sigma) ** 2
            by_scale = float(np.sum(trust * miss * reference)) - log_ratio / (
                prior.sigma**2 * scale
            )
            slope = by_scale * self._scale_slope(scale)
            by_offset = by_offset + slope * weight * reference
            by_yaw += slope * float(np.sum(offset * about_z(reference)))
        by_p = by_offset - by_offset.mean(axis=0) + by_yaw * frame.yaw_by_p
        return value, by_p, by_w + by_yaw * frame.yaw_by_w

    def _rotation(self, q_NG: Array, frame: FormationFrame) -> tuple[float, Array]:
        model = self._model
        if model.axial:
            kappa = kernels.axis_concentration(model.sigma_q)
            z, reference = axis_of(q_NG, 2), frame.turned(axis_of(model.X_FG.q, 2))
            return kappa * float(np.sum(z * reference)), kappa * cross(z, reference)
        kappa = kernels.rotation_concentration(model.sigma_q)
        centre = quat_multiply(quat_about_axis(_Z, np.asarray(frame.yaw)), model.X_FG.q)
        d = kappa * np.sum(q_NG * centre, axis=-1)
        value = float(np.sum(np.abs(d) + np.log1p(np.exp(-2.0 * np.abs(d)))))
        return value, 0.5 * kappa * np.tanh(d)[:, None] * quat_multiply(
            centre, quat_conjugate(q_NG)
        )[:, 1:]

    def _scale_slope(self, scale: float) -> float:
        """Return the scale's slope over the overlap of grippers and reference."""
        return self._likelihood.scale_slope if scale > SMALLEST_SCALE else 0.0


class QueryFactor:
    """log Q_n, or log C_n, of one gripper.

    Parameters
    ----------
    query : NormalisedQuery or ResampledQuery
        The gripper's query density.
    """

    def __init__(self, query: Query):
        self._query = query

    def __call__(self, X_NG: Pose) -> tuple[float, Array, Array]:
        """Return the logarithm and its gradients (1, 3) by p and w for one gripper X_NG (1,)."""
        value, by_p, by_w = self._query.log_density_and_gradient(X_NG)
        return float(value[0]), by_p, by_w


class VotesFactor:
    """gamma log V at the formation's origin, and yaw for several grippers.

    Parameters
    ----------
    likelihood : ContactLikelihood
        Likelihood with votes.
    frames : FormationFrames
        Formation frames of its configuration model.
    """

    def __init__(self, likelihood: ContactLikelihood, frames: FormationFrames):
        assert likelihood.votes is not None
        self._frames, self._votes, self._gamma = frames, likelihood.votes, likelihood.gamma

    def __call__(self, X_NG: Pose) -> tuple[float, Array, Array]:
        """Return the logarithm and its gradients by p and w, (n, 3) each."""
        frame = self._frames(X_NG)
        at = np.append(frame.origin[:2], frame.yaw) if self._votes.with_yaw else frame.origin[:2]
        value, slope = self._votes.density.log_density_and_gradient(at)
        by_p, by_w = np.zeros((2, *X_NG.p.shape))
        by_p[:, :2] = self._gamma * slope[:2] / len(X_NG.p)
        if self._votes.with_yaw:
            by_p = by_p + self._gamma * slope[2] * frame.yaw_by_p
            by_w = self._gamma * slope[2] * frame.yaw_by_w
        return self._gamma * float(value), by_p, by_w


class LikelihoodFactors:
    """All factors of log J.

    Parameters
    ----------
    likelihood : ContactLikelihood
        The likelihood.
    frames : FormationFrames
        Formation frames of its configuration model.

    Attributes
    ----------
    named : list of (str, Factor, slice)
        Name of each factor's logarithm, the factor, and the grippers that it depends on.
    """

    def __init__(self, likelihood: ContactLikelihood, frames: FormationFrames):
        every = slice(None)
        self.named: list[tuple[str, Factor, slice]] = [
            ("log H", ConfigurationFactor(likelihood, frames), every)
        ]
        if likelihood.votes is not None:
            self.named.append(("gamma log V", VotesFactor(likelihood, frames), every))
        for k, query in enumerate(likelihood.queries):
            self.named.append((f"log Q_{k + 1}", QueryFactor(query), slice(k, k + 1)))

    def __call__(self, X_NG: Pose) -> tuple[float, Array, Array]:
        """Return log J of grippers X_NG (n,) and its gradients by p and w, (n, 3) each."""
        value, by_p, by_w = 0.0, np.zeros_like(X_NG.p), np.zeros_like(X_NG.p)
        for _, factor, grippers in self.named:
            log_f, f_p, f_w = factor(Pose(X_NG.p[grippers], X_NG.q[grippers]))
            value += log_f
            by_p[grippers] += f_p
            by_w[grippers] += f_w
        return value, by_p, by_w

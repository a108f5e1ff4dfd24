"""Static equilibrium of a payload on several cables as a constraint on poses and tensions."""

import numpy as np

from drake_aerial.contacts.likelihood.formation_frame import FormationFrames, about_z
from drake_aerial.geometry import Array, Pose, cross, skew
from drake_aerial.statics.tensions import balance_matrix, moment_axes

_Z = np.array([0.0, 0.0, 1.0])
# Well below `BALANCE_TOLERANCE`, so that solutions of the program pass that check.
_TOLERANCE = 0.003


class EquilibriumConstraint:
    """Balance of forces and moments on the level payload: cable tensions against the weight.

    Values: sum_i T_i d_i - e_z (3), and the moments about the mean contact over the formation's
    size (3); T_i is the tension of cable i as a part of the weight. Collinear contacts (two always
    are) let the payload swing about their line: the moment about it is left out.

    Parameters
    ----------
    frames : FormationFrames
        Formation frames, which give the cables' directions, n > 1.
    X_NG : Pose
        Grippers of the seed, batch (n,).
    centre : (2,) array
        Horizontal position of the believed centre of mass in N [m].
    """

    def __init__(self, frames: FormationFrames, X_NG: Pose, centre: Array):
        self._frames, self._centre = frames, np.append(centre, 0.0)
        self._cables = frames.configuration.cable_direction
        offset = X_NG.p - X_NG.p.mean(axis=0)
        self._size = max(float(np.linalg.norm(offset, axis=1).max()), 1e-3)
        self._ends: tuple[int, int] | None = None
        if len(moment_axes(X_NG.p)) < 3:
            gaps = np.linalg.norm(X_NG.p[:, None] - X_NG.p, axis=-1)
            a, b = np.unravel_index(np.argmax(gaps), gaps.shape)
            self._ends = int(a), int(b)
        self.lower, self.upper = np.full(6, -_TOLERANCE), np.full(6, _TOLERANCE)

    def __call__(self, X_NG: Pose, tension: Array) -> tuple[Array, Array, Array, Array]:
        """Return values (6,) and their Jacobians by p and w (6, n, 3) and by tensions (6, n)."""
        n, size = len(tension), self._size
        frame = self._frames(X_NG)
        d = frame.turned(self._cables)
        arm = (X_NG.p - frame.origin) / size
        at = (self._centre - frame.origin) * [1.0, 1.0, 0.0] / size
        pull, turn = tension[:, None] * d, tension[:, None] * about_z(d)

        moment = np.sum(cross(arm, pull), axis=0) - cross(at, _Z)
        # d(arm x pull) = -pull x d(arm); the mean contact moves with every gripper.
        by_arm = -skew(pull) / size
        moment_by_p = by_arm - by_arm.mean(axis=0)
        moment_by_p[:, 0, 1] += 1.0 / (n * size)
        moment_by_p[:, 1, 0] -= 1.0 / (n * size)
        by_tension, moment_by_yaw = balance_matrix(arm, d), np.sum(cross(arm, turn), axis=0)
        if self._ends is not None:
            a, b = self._ends
            length = float(np.linalg.norm(X_NG.p[b] - X_NG.p[a]))
            e = (X_NG.p[b] - X_NG.p[a]) / max(length, 1e-6)
            across = np.eye(3) - np.outer(e, e)
            by_e = -(np.outer(e, moment) + (moment @ e) * np.eye(3)) @ across / max(length, 1e-6)
            moment_by_p = across @ moment_by_p
            moment_by_p[b] += by_e
            moment_by_p[a] -= by_e
            moment, moment_by_yaw = across @ moment, across @ moment_by_yaw
            by_tension[3:] = across @ by_tension[3:]

        value = np.concatenate([pull.sum(axis=0) - _Z, moment])
        by_yaw = np.concatenate([turn.sum(axis=0), moment_by_yaw])
        by_p = by_yaw[:, None, None] * frame.yaw_by_p
        by_p[3:] += moment_by_p.transpose(1, 0, 2)
        return value, by_p, by_yaw[:, None, None] * frame.yaw_by_w, by_tension

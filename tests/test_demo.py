import numpy as np
import pytest

from drake_aerial import ContactSolutions, JobError, Payload
from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.contacts.feasibility.reasons import Reason, ReasonKind
from drake_aerial.contacts.solutions import Solution
from drake_aerial.demo import PAYLOAD, SCAN_NOISE, VIEWPOINT, _best, scan_of
from drake_aerial.geometry import Pose


def test_the_scan_has_the_noise_of_the_camera_and_no_far_sides():
    payload = Payload.read(PAYLOAD)
    scan = scan_of(payload, seed=0)
    exact = partial_view(payload.to_trimesh(), VIEWPOINT)
    _, _, distance = payload.closest_point(scan.points)
    assert np.median(distance) == pytest.approx(0.67 * SCAN_NOISE, rel=0.5)
    assert len(scan) == pytest.approx(len(exact), rel=0.02)
    # The camera is at +x and -y of the box; noise alone reaches beyond its other sides.
    assert (scan.points[:, 0] < payload.vertices[:, 0].min() + 0.01).mean() < 0.05


def test_a_method_without_feasible_contacts_is_a_job_error():
    level = np.array([[1.0, 0.0, 0.0, 0.0]])
    X, up = Pose(np.zeros((1, 3)), level), np.array([[0.0, 0.0, 1.0]])
    reason = Reason(ReasonKind.UPSIDE_DOWN_AFTER_MOVE, None, value=-1.0)
    bad = Solution(1, 0.0, False, (reason,), X, up, X)
    contacts = ContactSolutions("task", 0, "flat", {}, {}, (bad,))
    with pytest.raises(JobError, match="learnt contact: all 1 contacts are infeasible: upside"):
        _best(contacts, "learnt contact")

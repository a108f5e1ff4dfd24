"""Trust in contacts.json, its words, and the shipped model."""

import json
from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.contacts.trust.evidence import Evidence
from drake_aerial.contacts.trust.statements import low_trust, statements
from drake_aerial.contacts.trust.trust import Trust
from drake_aerial.contacts.trust.trust_model import TrustModel, terms_of

GOOD = Evidence(
    whole=0.003,
    near=0.002,
    unexplained=0.003,
    box_fit=0.003,
    better_elsewhere=-0.03,
    counterparts=0.95,
    box_distance=0.01,
    box_nearest=0.01,
    height=0.0,
    above=0.0,
    proportions=0.1,
    fill=0.0,
    gap=5.0,
    gap_distance=0.4,
    cut=0.0,
    size_ratio=0.2,
    size=0.5,
)
BAD = replace(
    GOOD,
    whole=0.05,
    near=0.04,
    unexplained=0.05,
    box_fit=0.045,
    better_elsewhere=0.01,
    counterparts=0.2,
    box_distance=0.5,
    box_nearest=0.3,
    height=0.4,
    gap=0.2,
    gap_distance=0.6,
)


def test_trust_survives_the_file():
    trust = Trust(0.625, ("a",), ("b", "c"))
    assert Trust.from_dict(json.loads(json.dumps(trust.to_dict()))) == trust


@pytest.mark.parametrize("probability", [-0.1, 1.5, float("nan")])
def test_an_impossible_probability_is_refused(probability):
    with pytest.raises(ValueError, match="probability"):
        Trust.from_dict({"probability": probability, "for": [], "against": []})


def test_words_name_what_speaks_against_with_lengths():
    speaks_for, against = statements(BAD)
    assert speaks_for == ()
    text = "; ".join(against)
    assert "three quarters of the demonstrated edges have no counterpart" in text
    assert "another place 30 cm away is nearly as likely" in text
    assert "the demonstrated place in the bounding box is 25 cm away" in text
    assert "the contact lies 20 cm higher than the demonstrated one" in text


def test_words_name_what_speaks_for():
    speaks_for, against = statements(GOOD)
    assert against == ()
    assert "nearly all of the demonstrated edges have a counterpart" in speaks_for
    assert "no other place is nearly as likely" in speaks_for


def test_the_line_about_low_trust_says_why_and_what_to_do():
    line = low_trust(Trust(0.2, (), ("the scan is cut off in 20 % of the directions",)), 0.5)
    assert line.startswith("trust 0.20 in the best contact is below `min_trust` = 0.5: the scan is")
    assert "\n" not in line


def test_the_shipped_model_trusts_good_evidence_and_not_bad():
    model = TrustModel.shipped()
    assert model.probability_of(GOOD) > 0.85
    assert model.probability_of(BAD) < 0.1


def test_the_shipped_model_knows_its_terms_and_where_it_comes_from():
    model = TrustModel.shipped()
    assert set(model.weights) <= set(terms_of(GOOD))
    assert {"script", "commit", "master_seed", "answers"} <= set(model.provenance)
    assert np.all(np.diff(model.log_odds) > 0.0)
    assert np.all(np.diff(model.probability) >= 0.0)
    again = TrustModel.from_dict(json.loads(json.dumps(model.to_dict())))
    assert again.probability_of(BAD) == model.probability_of(BAD)


def test_log_odds_are_the_weighted_sum_of_terms():
    model = TrustModel(
        1.0, {"counterparts": 2.0, "cut": -1.0}, np.array([-9.0, 9.0]), np.array([0.0, 1.0]), {}
    )
    expected = (1.0 + 2.0 * 0.95 + 9.0) / 18.0
    assert model.probability_of(GOOD) == pytest.approx(expected)

import io
import zipfile

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.io import archives
from drake_aerial.io.archives import load_archive, load_arrays


def test_arrays_come_back_by_name(tmp_path):
    np.savez_compressed(tmp_path / "two.npz", a=np.arange(3), b=np.array("text"))
    loaded = load_archive(tmp_path / "two.npz", "a pair")
    assert sorted(loaded) == ["a", "b"]
    assert loaded["a"].tolist() == [0, 1, 2]
    assert str(loaded["b"]) == "text"


def test_a_bare_array_is_no_archive(tmp_path):
    np.save(tmp_path / "one.npy", np.arange(3))
    assert load_arrays(tmp_path / "one.npy").tolist() == [0, 1, 2]
    with pytest.raises(InputError, match=r"one\.npy must be a skill \(an \.npz archive\)"):
        load_archive(tmp_path / "one.npy", "a skill")


def test_an_archive_that_unpacks_to_more_than_the_limit_is_refused_unread(tmp_path, monkeypatch):
    np.savez_compressed(tmp_path / "bomb.npz", a=np.zeros(1000))
    monkeypatch.setattr(archives, "LARGEST", 8000)
    with pytest.raises(InputError, match="must unpack to at most 8,000 bytes, got 8,128"):
        load_arrays(tmp_path / "bomb.npz")
    monkeypatch.setattr(archives, "LARGEST", 8128)
    assert len(load_arrays(tmp_path / "bomb.npz")["a"]) == 1000


def test_a_size_in_the_archive_that_lies_yields_no_more_than_it_says(tmp_path):
    """The limit trusts the archive's own table; Python's reader stops at the size in it."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        array = io.BytesIO()
        np.save(array, np.zeros(100_000))
        archive.writestr("a.npy", array.getvalue())
    data = content.getvalue()
    size = len(array.getvalue()).to_bytes(4, "little")
    assert data.count(size) == 2
    (tmp_path / "liar.npz").write_bytes(data.replace(size, (200).to_bytes(4, "little")))
    with pytest.raises(InputError, match="not a valid NPZ file, or cut short"):
        load_arrays(tmp_path / "liar.npz")


def test_members_that_are_no_arrays_are_harmless(tmp_path):
    with zipfile.ZipFile(tmp_path / "text.npz", "w") as archive:
        archive.writestr("readme.txt", "hello")
    assert load_arrays(tmp_path / "text.npz")["readme.txt"].shape == ()

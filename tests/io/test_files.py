import pytest

from drake_aerial.errors import InputError
from drake_aerial.io.files import replacing, write_text


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "result.json"
    write_text(path, "old")

    def fail_half_way():
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        fail_half_way()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]


def test_folders_are_made_and_the_suffix_is_kept(tmp_path):
    with replacing(tmp_path / "a" / "b" / "x.npz") as temporary:
        assert temporary.name.endswith(".x.npz")
        temporary.write_bytes(b"1")
    assert (tmp_path / "a" / "b" / "x.npz").read_bytes() == b"1"


def test_a_folder_in_the_way_is_named(tmp_path):
    with pytest.raises(InputError, match="is a folder"):
        write_text(tmp_path, "text")
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot write"):
        write_text(tmp_path / "file" / "below.txt", "text")

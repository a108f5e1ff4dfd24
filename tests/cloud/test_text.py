import numpy as np
import pytest

from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError

P = np.array([[0.5, -1.25, 3.0], [1e-3, 2.0, 0.25], [7.0, 8.5, -9.0]])


def lines(separator, rows=P, decimal="."):
    return "".join(separator.join(map(str, row)).replace(".", decimal) + "\n" for row in rows)


WIDE = np.c_[P, [[9, 9, 9]] * 3]
TEXTS = {
    "blanks": lines(" "),
    "many blanks, indented": "   " + lines("   ").replace("\n", "\n   "),
    "tabs": lines("\t"),
    "commas": lines(","),
    "commas and blanks": lines(" , "),
    "semicolons": lines(";"),
    "semicolons and decimal commas": lines(";", decimal=","),
    "colours after": lines(" ", WIDE),
    "comments": "# x y z\n// more\n\n" + lines(" "),
    "a byte order mark": "\ufeff" + lines(" "),
    "CRLF": lines(",").replace("\n", "\r\n"),
    "the number of points first": "3\n" + lines(" "),
    "names": "x,y,z\n" + lines(","),
    "names in capitals and quotes": '"X","Y","Z"\n' + lines(","),
    "names with units": "x [m];y [m];z [m]\n" + lines(";"),
    "names in another order": "id,z,intensity,y,x\n"
    + "".join(f"1,{z},7,{y},{x}\n" for x, y, z in P.tolist()),
    "names by blanks": "x y z intensity\n" + lines(" ", np.c_[P, [1, 2, 3]]),
    "names of positions": "nx,ny,nz,pos_x,pos_y,pos_z\n" + lines(",", WIDE[:, [3, 4, 5, 0, 1, 2]]),
}


@pytest.mark.parametrize("row", TEXTS)
@pytest.mark.parametrize("suffix", [".xyz", ".txt", ".csv", ".pts", ".asc"])
def test_points(tmp_path, row, suffix):
    path = tmp_path / f"scan{suffix}"
    path.write_bytes(TEXTS[row].encode())
    np.testing.assert_array_equal(read_geometry(path).points, P)


def test_missing_values_are_not_a_number(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z\n1,2,3\n,,\n4,nan,NaN\n")
    points = read_geometry(tmp_path / "a.csv").points
    np.testing.assert_array_equal(np.isfinite(points).all(axis=1), [True, False, False])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("# nothing\n", "holds no points"),
        ("x,y,z\n", "holds no points"),
        ("a,b,c\n1,2,3\n", "not a valid CSV file: no columns x, y, z, only a, b, c"),
        ("1,2\n3,4\n", "line 1 has 2 columns, three are needed"),
        ("1,2,3\n4,5\n", "line 2 has 2 columns"),
        ("1,2,3\n4,five,6\n", "line 2 is not numbers: '4,five,6'"),
        ("5\n1 2 3\n4 5 6\n", "cut short: 5 points declared, 2 present"),
        ("2\nwater\nO 0 0 0\nH 0 0 1\n", "no columns x, y, z, only water"),
    ],
)
def test_bad_files_are_refused_with_the_true_reason(tmp_path, text, reason):
    (tmp_path / "scan.csv").write_text(text)
    with pytest.raises(InputError, match=reason):
        read_geometry(tmp_path / "scan.csv")

"""Names between quotation marks may hold the character that separates fields."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from driftwalk.core.errors import FormatError
from driftwalk.record import load


@pytest.mark.parametrize("names", [("a,b", "c"), ("a,b", ",,"), ('say ""x,y""', "c")])
def test_a_delimiter_in_every_name_is_part_of_the_names(
    names: tuple[str, str], tmp_path: Path
) -> None:
    rows = [f'{t},{t}.5,{n},"{name}"' for t in range(3) for n, name in enumerate(names)]
    (tmp_path / "a.csv").write_text("\n".join(["t_s,x_m,y_m,body", *rows, ""]))
    back = load(tmp_path / "a.csv")
    assert back["body"].values.tolist() == [name.replace('""', '"') for name in names]
    np.testing.assert_array_equal(back["x"].values[:, 1], [0.5, 1.5, 2.5])


def test_a_mark_that_is_not_closed_is_still_found(tmp_path: Path) -> None:
    rows = ['0,1,2,"a', '1,1,2,"a"', '2,1,2,"a"']
    (tmp_path / "a.csv").write_text("\n".join(["t_s,x_m,y_m,body", *rows, ""]))
    with pytest.raises(FormatError):
        load(tmp_path / "a.csv")

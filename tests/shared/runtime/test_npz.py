"""Files of arrays are held against their size before anything in them is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadriga.shared.runtime.npz import open_npz


@pytest.mark.parametrize(("mega_bytes", "taken"), [(60, True), (200, False)])
def test_what_unpacks_to_much_of_nothing_is_refused(
    tmp_path: Path, mega_bytes: int, *, taken: bool
) -> None:
    path = tmp_path / "bomb.npz"
    np.savez_compressed(path, a=np.zeros(mega_bytes * 125_000))
    if taken:
        with open_npz(path) as archive:
            assert archive["a"].nbytes == mega_bytes * 1_000_000
        return
    with pytest.raises(ValueError, match="arrays of 200,"), open_npz(path):
        pass

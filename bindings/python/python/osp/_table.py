"""Columns of equal length."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict

import numpy as np

if TYPE_CHECKING:
    import pandas

_LETTERS = {"color": "rgba", "position": "xyz", "rotation": "xyzw"}


class Table(Dict[str, "np.ndarray[Any, Any]"]):
    """A dict of columns (numpy arrays) of equal length.

    `to_pandas` makes a data frame. If every column has one dimension, `pandas.DataFrame(table)` does so, too.

    >>> table = osp.Table(time_secs=np.array([0.0, 0.5]), position=np.array([[0, 1, 2], [3, 4, 5]]))
    >>> table.rows
    2
    >>> list(table.to_pandas().columns)
    ['time_secs', 'position_x', 'position_y', 'position_z']
    """

    @property
    def rows(self) -> int:
        """Number of rows of all columns."""
        return next((len(column) for column in self.values()), 0)

    def to_pandas(self) -> pandas.DataFrame:
        """Returns the table as a data frame of pandas, which must be installed. A column of vectors becomes one column
        for each component: `position_x`, `color_r`, `corners_0_x`."""
        import pandas

        columns = {}
        for name, column in self.items():
            for place in np.ndindex(column.shape[1:]):
                letters = _LETTERS.get(name, "xyz")
                parts = [name, *map(str, place)]
                if place and place[-1] < len(letters):
                    parts[-1] = letters[place[-1]]
                columns["_".join(parts)] = column[(slice(None), *place)]
        return pandas.DataFrame(columns)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.rows} rows: {', '.join(self)}>"

"""Results as tables with units, and as the frames and arrays of other libraries where those are installed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.errors import InputError

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True, eq=False)
class AngleTable:
    """Joint angles over time.

    Attributes
    ----------
    time : (T,) s, the marker file's clock
    names : A column names, those of ``angles.csv``
    degrees : (T, A), NaN where the sequence of rotations is singular
    convention, title : which convention, and what it is
    zero : "recorded", or "neutral" where the angles are relative to a neutral pose
    zero_pose : what the angles are counted from, in words
    positive : A, what a positive value means
    """

    time: np.ndarray
    names: tuple[str, ...]
    degrees: np.ndarray
    convention: str
    title: str
    zero: str
    zero_pose: str
    positive: tuple[str, ...]

    @classmethod
    def of(cls, angles: JointAngles) -> AngleTable:
        """From the stage's result."""
        degrees = np.where(angles.singular, np.nan, angles.degrees)
        return cls(
            angles.time, angles.names, degrees, angles.convention, angles.title, angles.zero, angles.zero_pose,
            angles.positive,
        )  # fmt: skip

    def __getitem__(self, name: str) -> np.ndarray:
        """(T,) degrees, one angle by its name."""
        if name not in self.names:
            raise KeyError(f"{name!r} is no angle of the convention {self.convention}: {', '.join(self.names)}")
        return self.degrees[:, self.names.index(name)]

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"<AngleTable: {len(self.names)} angles x {len(self.time)} frames, degrees, {self.convention}>"

    def to_pandas(self) -> pandas.DataFrame:
        """A frame with a column for each angle in degrees, indexed by time in s.

        Raises
        ------
        InputError : pandas is not installed
        """
        pd: Any = _library("pandas")
        frame = pd.DataFrame(self.degrees, index=pd.Index(self.time, name="time"), columns=list(self.names))
        frame.attrs |= self._about
        return frame

    def to_xarray(self) -> xarray.DataArray:
        """An array (time, angle) in degrees with its units, convention and zero as attributes.

        Raises
        ------
        InputError : xarray is not installed
        """
        xr: Any = _library("xarray")
        return xr.DataArray(
            self.degrees,
            dims=("time", "angle"),
            coords={
                "time": ("time", self.time, {"units": "s"}),
                "angle": list(self.names),
                "positive": ("angle", list(self.positive)),
            },
            name="joint_angles",
            attrs=self._about,
        )

    @property
    def _about(self) -> dict[str, str]:
        said = {"convention": self.convention, "title": self.title, "zero": self.zero, "zero_pose": self.zero_pose}
        return {"units": "degrees", **said}


@dataclass(frozen=True, eq=False)
class Points:
    """Named points over time: markers, or joint centres.

    Attributes
    ----------
    time : (T,) s, the marker file's clock
    names : N names
    positions : (T, N, 3) m, z up, NaN = lost
    rate : Hz
    filled : (T, N) True where a position was interpolated or modelled, not measured
    bones : N, the bone each point sits on; "" where that is not known
    """

    time: np.ndarray
    names: tuple[str, ...]
    positions: np.ndarray
    rate: float
    filled: np.ndarray
    bones: tuple[str, ...]

    def __getitem__(self, name: str) -> np.ndarray:
        """(T, 3) m, one point by its name."""
        if name not in self._index:
            raise KeyError(f"{name!r} is not among {', '.join(self.names)}")
        return self.positions[:, self._index[name]]

    def __contains__(self, name: object) -> bool:
        return name in self._index

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"<Points: {len(self.names)} points x {len(self.time)} frames, m, z up, {self.rate:g} Hz>"

    @cached_property
    def _index(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.names)}

    def to_pandas(self) -> pandas.DataFrame:
        """A frame with columns (name, axis) in metres, indexed by time in s.

        Raises
        ------
        InputError : pandas is not installed
        """
        pd: Any = _library("pandas")
        columns = pd.MultiIndex.from_product([self.names, list("xyz")], names=["point", "axis"])
        table = self.positions.reshape(len(self.time), -1)
        return pd.DataFrame(table, index=pd.Index(self.time, name="time"), columns=columns)

    def to_xarray(self) -> xarray.Dataset:
        """A dataset in the layout of the ``movement`` package: ``position`` (time, space, keypoints, individuals) in m.

        ``confidence`` is 1 where a position was measured, 0 where it was filled and NaN where it is lost.

        Raises
        ------
        InputError : xarray is not installed
        """
        xr: Any = _library("xarray")
        confidence = np.where(np.isfinite(self.positions).all(axis=2), np.where(self.filled, 0.0, 1.0), np.nan)
        return xr.Dataset(
            {
                "position": (
                    ("time", "space", "keypoints", "individuals"),
                    self.positions.transpose(0, 2, 1)[..., None],
                    {"units": "m"},
                ),
                "confidence": (("time", "keypoints", "individuals"), confidence[..., None]),
            },
            coords={
                "time": ("time", self.time, {"units": "s"}),
                "space": list("xyz"),
                "keypoints": list(self.names),
                "individuals": ["subject"],
                "bone": ("keypoints", list(self.bones)),
            },
            attrs={"fps": self.rate, "time_unit": "seconds", "source_software": "Markerscope", "ds_type": "poses"},
        )


def _library(name: str) -> Any:
    """A library that is used if it is there.

    Raises
    ------
    InputError : it is not
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(f"needs {name}, which is not installed", remedy=f"pip install {name}") from error
